"""The sections of a report, in the order in which they appear."""

from sea_ident.report.section import Section
from sea_ident.report.sections.correlation import Correlation
from sea_ident.report.sections.detectability import DetectabilitySection
from sea_ident.report.sections.excitation import ExcitationSection
from sea_ident.report.sections.findings import Findings
from sea_ident.report.sections.gap import GapSection
from sea_ident.report.sections.locations import Locations
from sea_ident.report.sections.missing import Missing
from sea_ident.report.sections.parameters import Parameters
from sea_ident.report.sections.residuals import Residuals
from sea_ident.report.sections.robot_motion import RobotMotion
from sea_ident.report.sections.springs import Springs
from sea_ident.report.sections.torque import Torque
from sea_ident.report.sections.validations import Validations
from sea_ident.report.sections.verdict import VerdictSection

SECTIONS: tuple[Section, ...] = (
    VerdictSection(),
    GapSection(),
    Missing(),
    Locations(),
    DetectabilitySection(),
    Findings(),
    RobotMotion(),
    Parameters(),
    Torque(),
    Residuals(),
    Validations(),
    Springs(),
    Correlation(),
    ExcitationSection(),
)

__all__ = ["SECTIONS"]
