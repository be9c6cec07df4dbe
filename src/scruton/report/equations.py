"""The equations of the report, each in one place."""

from scruton.report.maths import bracket, differential, dot, frac, paren, power, prime, row, star, sub

SC, SC_NEW, A_STAR = row("Sc"), prime("Sc"), star("a")
XI_S, OMEGA_0, XI_AERO = sub("xi", "s"), sub("omega", "0"), sub("xi", "aero")
SC_LAMBDA = sub("Sc", "lambda")

AMPLITUDE = row(
    frac(differential("a"), differential("t")), "=", frac("lambda", "n"), "a",
    bracket("1", "-", power(paren(frac("a", A_STAR)), "n")),
)  # fmt: skip
SCRUTON_HEAVING = row("Sc", "=", frac(row("4", "pi", "m", XI_S), row("rho", "B", "D")))
SCRUTON_TORSIONAL = row("Sc", "=", frac(row("4", "pi", "J", XI_S), row("rho", power("B", "3"), "D")))
GRIFFIN = row("A", paren(SC_NEW), "=", A_STAR, power(paren("1", "-", "n", "x"), row("1", "/", "n")))
INDEX = row("x", "=", frac(row(SC_NEW, "-", "Sc"), SC_LAMBDA))
RELAXATION = row(SC_LAMBDA, "=", frac(row("Sc", "lambda"), row(OMEGA_0, XI_S)))
RECIPROCAL = row(frac("1", row("A", paren(SC_NEW))), "=", frac("1", A_STAR), paren("1", "+", "x"))
STRENGTH = row("G", "=", SC_LAMBDA, "+", "max", paren(row("n", ",", "0")), "Sc")
TRIAL = row("A", paren("t"), "=", "a", power("e", row("b", "t")), "+", "c", power("e", row("d", "t")))
AERODYNAMIC = row(
    XI_AERO, "=", "-", frac("1", "omega"), bracket(frac(dot("A"), "A"), "+", XI_S, OMEGA_0)
)  # fmt: skip
REQUIRED = row(XI_S, paren("A"), "=", "-", XI_AERO, frac("omega", OMEGA_0))
