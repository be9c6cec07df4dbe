"""One run of a verb: its folder, what it was made from, how far it is, and what is said of it in the end."""

import json
from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256 as _sha256
from itertools import chain, count
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from scruton.documents import as_json, write_document
from scruton.progress import Bar
from scruton.provenance import provenance
from scruton.terminal import DONE
from scruton.workspace import Workspace, results_in

if TYPE_CHECKING:
    from scruton.infer.cards import ModelCard
    from scruton.workers import Workers


@dataclass(frozen=True)
class Outcome:
    """What a verb says when it has ended."""

    text: str = ""  # tables and sentences for standard output; neither with --quiet nor with --json
    paths: Sequence[Path] = ()  # for standard output, unless it is JSON: where the results lie
    remarks: Sequence[str] = ()  # for standard error: why the results are not to be trusted
    code: int = DONE  # of the exit
    content: Mapping[str, Any] | None = None  # for --json; else it is what the first JSON file of `paths` holds

    @property
    def json(self) -> str:
        """The results as JSON: the content, the first JSON file, or else where the results lie."""
        if self.content is not None:
            return json.dumps(as_json(self.content))
        file = next((path for path in self.paths if path.suffix == ".json"), None)
        if file is not None:
            return file.read_text(encoding="utf-8").rstrip("\n")
        return json.dumps({"paths": [str(path) for path in self.paths]})


class Run(Workspace):
    """A verb's claim on a folder, with the provenance of all that it writes there, and the bar of its progress.

    The seed, --quiet, --force and --resume are the command line's; the rest is as of `Workspace`.
    """

    def __init__(
        self,
        folder: Path,
        verb: str,
        arguments: Namespace,
        *,
        sha256: Mapping[str, str],
        settings: Mapping[str, Any],
        results: Sequence[str],
        card: "ModelCard | None" = None,
        grows: bool = False,
    ) -> None:
        stated = None if card is None else {"name": card.name, "sha256": card.sha256}
        self.provenance = provenance(verb, seed=arguments.seed, sha256=sha256, settings=settings, card=stated)
        # All that a card says, whatever cards it extends.
        cards = {} if card is None else {f"model card {card.name}": _sha256(card.resolved.encode()).hexdigest()}
        settings = {"seed": arguments.seed, "version": self.provenance["versions"]["scruton"], **settings}
        force, resume = arguments.force, getattr(arguments, "resume", False)
        super().__init__(
            folder, verb, inputs={**sha256, **cards}, settings=settings, results=results, force=force, resume=resume,
            grows=grows,
        )  # fmt: skip
        self.bar = Bar(arguments.quiet)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.bar.end()
        super().__exit__(kind, error, _)

    def write(self, name: str, content: Mapping[str, Any]) -> None:
        """Write a JSON of the results, with its provenance and what else it says of that."""
        more = content.get("provenance", {})
        write_document(self.new / name, {**content, "provenance": {**self.provenance, **more}})

    def published(self, written: Iterable[Path] = ()) -> list[Path]:
        """Put the results into their places; where the files that were written lie now."""
        paths = [self.folder / path.relative_to(self.new) for path in written]
        self.publish()
        return paths


def default_folder(campaign: Path) -> Path:
    """Where results go when no folder is named: out/NAME below the working folder."""
    return Path("out") / campaign_folder(campaign).resolve().name


def workers_of(arguments: Namespace) -> "Workers":
    """Who does the work, as the command line says; where it names no number of processes, one a core.

    InputError for a scheduler that cannot be reached or used.
    """
    from scruton.workers import Workers, cores

    tls = arguments.tls_ca, arguments.tls_cert, arguments.tls_key
    return Workers(arguments.jobs or cores(), arguments.scheduler, tls).reached()


def variant(folder: Path, name: str, results: Sequence[str]) -> Path:
    """The folder, or the first of FOLDER-2, FOLDER-3, ... that holds no results of a run of that name."""
    numbered = (folder.with_name(f"{folder.name}-{i}") for i in count(2))
    return next(place for place in chain([folder], numbered) if not results_in(place, name, results))


def campaign_folder(campaign: Path) -> Path:
    """Folder of a campaign that was named by it, or by its campaign.toml."""
    return campaign.parent if campaign.name == "campaign.toml" else campaign
