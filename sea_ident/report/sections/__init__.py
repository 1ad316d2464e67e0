"""The sections of a report, in the order in which they appear."""

from sea_ident.report.section import Section
from sea_ident.report.sections.correlation import Correlation
from sea_ident.report.sections.excitation import ExcitationSection
from sea_ident.report.sections.findings import Findings
from sea_ident.report.sections.parameters import Parameters
from sea_ident.report.sections.residuals import Residuals
from sea_ident.report.sections.robot_motion import RobotMotion
from sea_ident.report.sections.springs import Springs
from sea_ident.report.sections.torque import Torque
from sea_ident.report.sections.validations import Validations

SECTIONS: tuple[Section, ...] = (
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
