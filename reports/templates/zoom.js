"use strict";
/* Pictures open at the size of the window, by pointer or key; again, and they are looked at from close by. */
(() => {
  const dialog = document.createElement("dialog");
  if (!dialog.showModal) return;
  const close = document.createElement("button"), large = document.createElement("img");
  close.textContent = "Close";
  dialog.append(close, large);
  document.body.append(dialog);
  const shut = () => { dialog.close(); dialog.classList.remove("close-up"); };
  close.addEventListener("click", shut);
  dialog.addEventListener("close", () => dialog.classList.remove("close-up"));
  dialog.addEventListener("click", (event) => { if (event.target === dialog) shut(); });
  large.addEventListener("click", () => dialog.classList.toggle("close-up"));
  for (const frame of document.querySelectorAll("figure .zoom")) {
    const picture = frame.querySelector("img"), button = document.createElement("button");
    button.className = "zoom";
    button.type = "button";
    const number = frame.closest("figure").querySelector(".label");
    button.setAttribute("aria-label", `Enlarge ${number ? number.textContent : "the picture"}: ${picture.alt}`);
    frame.replaceWith(button);
    button.append(picture);
    button.addEventListener("click", () => {
      large.src = picture.src;
      large.alt = picture.alt;
      dialog.setAttribute("aria-label", number ? number.textContent : "Picture");
      dialog.showModal();
      close.focus();
    });
  }
})();
