"""Remarks are ranked, worst first, and alike ones are one line."""

from scruton.campaign.plausibility import DAMPING, outside
from scruton.campaign.remarks import Remark, Severity, sentences
from scruton.campaign.spelling import figure
from scruton.campaign.thresholds import LISTED
from scruton.report.conventions import conventions, flag_texts
from scruton.said import Value, parts_of


def drift(name, value, severity=Severity.NOTE):
    return Remark(
        severity, "frequency drift", "record", name, f"the frequency drifts by {value} %.",
        "the frequency drifts by {} %", value, value / 1.0,
    )  # fmt: skip


def test_one_remark_is_its_own_sentence():
    assert sentences([drift("a.csv", 1.5)]) == ["a.csv: the frequency drifts by 1.5 %."]


def test_alike_remarks_fold_into_the_range_of_their_numbers_and_the_worst_comes_first():
    (line,) = sentences([drift("a.csv", 1.0), drift("b.csv", 2.6), drift("c.csv", 1.7)])
    assert line == "the frequency drifts by 1 to 2.6 % in 3 records: b.csv, c.csv, a.csv."


def test_a_long_list_of_names_is_cut():
    (line,) = sentences([drift(f"{i}.csv", 1.0 + i) for i in range(19)])
    assert "in 19 records" in line
    assert line.count(".csv") == LISTED
    assert line.endswith(f"and {19 - LISTED} more.")


def test_the_worst_remark_comes_first_whatever_the_order():
    rig = Remark(Severity.SERIOUS, "damping", "rig", "6#", "too much.", "too much", 100.0, 1.2)
    test = Remark(Severity.DOUBT, "levels", "test", "Sc 1", "two levels.", "two levels", 2.0, 90.0)
    found = [drift("a.csv", 50.0), test, rig]
    assert sentences(found) == sentences(found[::-1])
    assert sentences(found) == [
        "serious: rig 6#: too much.", "test Sc 1: two levels.", "a.csv: the frequency drifts by 50.0 %."
    ]  # fmt: skip


def test_remarks_below_a_severity_are_left_out():
    assert sentences([drift("a.csv", 1.0)], Severity.DOUBT) == []
    assert len(sentences([drift("a.csv", 1.0, Severity.DOUBT)], Severity.DOUBT)) == 1


def test_remarks_of_other_subjects_do_not_fold():
    one = Remark(Severity.DOUBT, "amplitude", "record", "a", "large.", "large", 1.0)
    other = Remark(Severity.DOUBT, "amplitude", "test", "a", "large.", "large", 1.0)
    assert len(sentences([one, other])) == 2


def test_a_remark_keeps_the_damping_that_it_is_about_alone_and_with_others():
    """So that a report shows it as its reader was promised: per cent, or the logarithmic decrement."""
    one, other = (
        next(outside(xi, DAMPING, "damping", "rig", rig, "the damping")) for xi, rig in ((0.12, "a"), (9e-5, "b"))
    )
    (alone,), (both,) = sentences([one]), sentences([one, other])
    assert alone == f"rig a: the damping is 12 %, outside 0.01 % to 10 % ({DAMPING.why})."
    assert both == f"the damping is 0.009 % to 12 %, outside 0.01 % to 10 % ({DAMPING.why}), in 2 rigs: a, b."
    for sentence, ratios in ((alone, [0.12, 1e-4, 0.1]), (both, [9e-5, 0.12, 1e-4, 0.1])):
        assert [part.value for part in sentence.parts if isinstance(part, Value)] == ratios
    with conventions({"conventions": {"damping": "decrement"}}):
        (shown,) = flag_texts([alone], {"flag_parts": parts_of([alone])})
    assert shown.startswith("rig a: the damping is δ = 0.754, outside δ = 0.000628 to δ = 0.628")


def test_figures_are_short_and_without_exponents_where_a_reader_would_stumble():
    assert [figure(one) for one in (0.0123, 1.27, 99.4, 993.2, 86400.0, 3.2e-8)] == [
        "0.012", "1.3", "99", "993", "86400", "3.2e-08"
    ]  # fmt: skip
