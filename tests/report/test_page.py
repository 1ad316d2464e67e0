"""The report as a file: complete, self-contained, and saying what the model says."""

import re
import warnings
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from sea_ident.estimation import Agreement
from sea_ident.exceptions import OutputError, SeaIdentError, SeaIdentWarning
from sea_ident.excitation import design_excitation
from sea_ident.report import write_report
from sea_ident.report.content import Content
from sea_ident.report.page import number, unit
from sea_ident.report.section import ModelSection
from sea_ident.report.sections import SECTIONS
from sea_ident.report.sections.findings import Findings
from sea_ident.report.sections.parameters import parameter_rows
from sea_ident.report.sections.springs import spring_curve
from sea_ident.simulation import ComputedTorque, simulate
from sea_ident.validation import validate

LARGEST = 5_000_000


class Page(HTMLParser):
    """Sections, references and tags that stay open."""

    VOID = frozenset({"meta", "link", "input", "br", "hr", "img"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.sections: list[str] = []
        self.references: list[str] = []
        self.open: list[str] = []
        self.text: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        record = dict(attrs)
        if tag == "section":
            self.sections.append(record["id"])
        self.references += [record[key] for key in ("src", "href", "srcset", "data", "action") if record.get(key)]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="session")
def validation(leg_model, leg_motion):
    recording = simulate(leg_model.robot, leg_motion, periods=3, seed=9, controller=ComputedTorque()).recording
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        return validate(leg_model, recording, period=leg_motion.period)


@pytest.fixture(scope="session")
def page_text(leg_model, validation, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(leg_model, path, validations=[validation])
    return path.read_text(encoding="utf-8")


def test_an_excitation_of_other_joints_is_refused(leg_model, tmp_path):
    excitation = design_excitation(leg_model.robot, starts=1, harmonics=2)
    other = replace(excitation, joint_names=("a", "b", "c"))
    with pytest.raises(SeaIdentError, match="is one of a, b, c, the model one of hip, knee, ankle"):
        write_report(leg_model, tmp_path / "r.html", excitation=other)
    assert not (tmp_path / "r.html").exists()


def test_the_springs_of_a_validation_are_on_the_page(page_text, validation):
    assert len(validation.springs) == 3
    table = page_text.split("less that of their law")[1].split("</table>")[0]
    for spring in validation.springs:
        cells = (spring.joint, number(spring.rms, 3), number(spring.noise_std, 3), number(100 * spring.nrms, 3))
        row = next(part for part in table.split("<tr>") if f"<td>{spring.joint}</td>" in part)
        assert re.findall(r"<td[^>]*>([^<]*)</td>", row)[:4] == list(cells)


def test_a_spring_that_does_not_hold_elsewhere_is_a_finding(leg_model, validation):
    first, *rest = validation.springs
    wrong = replace(validation, springs=(replace(first, warning="the law leaves half"), *rest))
    for given, said in ((validation, False), (wrong, True)):
        found = Findings().context(Content(leg_model, validations=(given,)))
        assert any("the law leaves half." in f.text for f in found["findings"]) == said


def test_the_page_is_well_formed_small_and_refers_to_nothing_outside(page_text):
    page = Page(page_text)
    assert page.open == []
    assert len(page_text.encode()) < LARGEST
    assert all(reference.startswith(("#", "data:")) for reference in page.references)
    outside = re.findall(r"(?:https?:)?//[a-z][\w.-]+\.[a-z]{2,}[^\s\"'<]*", page_text)
    assert [address for address in outside if "www.w3.org/2000/svg" not in address] == []
    assert "@import" not in page_text
    assert "url(" not in page_text


def test_every_section_with_data_is_there_and_the_others_are_named(page_text):
    page = Page(page_text)
    shown = set(page.sections)
    about_models = {section.key for section in SECTIONS if isinstance(section, ModelSection)}
    assert shown == about_models - {"excitation"}
    assert "excitation and its limits" in page_text


def test_every_parameter_stands_in_the_table_with_its_numbers(page_text, leg_model):
    table = page_text[page_text.index('id="parameters"') : page_text.index('id="torque"')]
    lower, upper = leg_model.interval()
    for k, name in enumerate(leg_model.base.names):
        row = next(r for r in table.split("<tr") if f">{name}<" in r)
        for value in (leg_model.values[k], lower[k], upper[k]):
            assert number(float(value)) in row


def test_parameter_rows_compare_with_the_description(leg_model):
    rows = {row.name: row for row in parameter_rows(leg_model)}
    assert rows["motor.rotor_inertia"].stated == pytest.approx(2.2e-5)
    assert rows["knee.coulomb_friction"].stated == pytest.approx(1.2)
    # thigh.mz with the mass of shank and foot at the knee: 4.9 kg at -0.216 m and 5.1 kg at -0.42 m
    assert rows["thigh.mz*"].stated == pytest.approx(4.9 * -0.216122449 - 0.42 * 5.1, abs=1e-6)


def test_findings_name_what_is_poor_and_what_is_off(leg_model):
    k = leg_model.base.names.index("foot.mx")
    shifted = leg_model.values.copy()
    shifted[k] *= 3.0
    covariance = leg_model.covariance.copy()
    j = leg_model.base.names.index("hip.viscous_friction")
    covariance[j, j] = (0.5 * leg_model.values[j]) ** 2
    uncertain = replace(leg_model.uncertainty, covariance=covariance)
    findings = Findings().context(Content(replace(leg_model, values=shifted, uncertainty=uncertain)))["findings"]
    poor = next(f for f in findings if f.head == "Poorly determined")
    assert "hip.viscous_friction (50 %)" in poor.text
    assert "foot.mx" not in poor.text
    off = next(f for f in findings if f.head == "Against the description")
    assert off.text.partition("most of all ")[2].startswith("foot.mx")


def test_findings_say_which_joint_is_not_explained(leg_model):
    agreement = Agreement(np.array([0.5, 0.1, 0.1]), np.array([0.3, 0.1, 0.1]), np.array([0.95, 0.95, 1.0]))
    rms = np.array([0.5, np.sqrt(0.95 * 0.1**2 + 0.05 * 0.4**2), 0.1])
    fit = replace(leg_model.fit, rms_residual=rms, agreement=agreement)
    findings = Findings().context(Content(replace(leg_model, fit=fit)))["findings"]
    levels = {f.head: f.level for f in findings}
    assert levels["hip"] == "warn"
    assert levels["knee"] == "good"
    # sqrt(0.5^2 - 0.3^2) = 0.4
    texts = {f.head: f.text for f in findings}
    assert "0.4 N m is not explained" in texts["hip"]
    assert "and 0.4 around them" in texts["knee"]
    assert "reversals" not in texts["ankle"]


def test_findings_say_where_the_noise_is_not_known(leg_model):
    fit = replace(leg_model.fit, agreement=None)
    findings = Findings().context(Content(replace(leg_model, fit=fit)))["findings"]
    assert all("its noise is not known" in f.text for f in findings if f.head in leg_model.robot.joint_names)


def test_springs_give_the_reason_of_their_verdict(page_text, leg_model):
    text = " ".join(Page(page_text).text)
    for spring in leg_model.springs:
        assert spring.note in text


def test_the_band_of_a_spring_is_the_spread_of_curves_drawn_from_its_covariance(leg_model):
    spring = replace(leg_model.springs[0], degrees_of_freedom=float("inf"))
    x = np.array([0.01, 0.03, 0.05])
    curve, half = spring_curve(spring, x)
    assert curve == pytest.approx(spring.stiffness * x + spring.cubic_stiffness * x**3)
    values = np.random.default_rng(0).multivariate_normal(
        [spring.stiffness, spring.cubic_stiffness, spring.damping], np.array(spring.covariance), 40_000
    )
    curves = values[:, :1] * x + values[:, 1:2] * x**3
    assert half == pytest.approx(1.96 * curves.std(axis=0), rel=0.03)


def test_names_from_files_cannot_inject_markup(leg_model, tmp_path):
    nasty = '</script><script>alert("x")</script><b>'
    model = replace(leg_model, recording=nasty, warnings=(nasty,))
    write_report(model, tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text()
    assert nasty not in text
    assert text.count("<script") == 2


def test_a_model_without_data_has_a_report_too(leg_model, tmp_path):
    none = leg_model.excerpt
    empty = replace(
        none,
        motion=none.motion[:0],
        tau_motor=none.tau_motor[:0],
        tau_std=none.tau_std[:0],
        tau_model=none.tau_model[:0],
        tau_spring=none.tau_spring[:0],
        residual_std=none.residual_std[:0],
    )
    write_report(replace(leg_model, excerpt=empty), tmp_path / "r.html")
    page = Page((tmp_path / "r.html").read_text())
    assert {"findings", "parameters", "robot_motion", "springs"} <= set(page.sections)
    assert "torque" not in page.sections


def test_a_folder_that_does_not_exist_is_an_error_and_nothing_is_written(leg_model, tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        write_report(leg_model, tmp_path / "no" / "r.html")
    assert list(tmp_path.iterdir()) == []


def test_numbers_and_units_for_people():
    assert number(-0.000123456) == "−0.0001235"
    assert number(1.5e-7, 3) == "1.5×10⁻⁷"
    assert number(None) == number(float("nan")) == "–"
    assert unit("kg m2") == "kg m²"
    assert unit("N m/rad3") == "N m/rad³"
