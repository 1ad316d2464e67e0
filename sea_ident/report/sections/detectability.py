"""What could have been seen, and what to do next."""

from typing import Any, ClassVar

from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.report.section import DiagnosisSection


class DetectabilitySection(DiagnosisSection):
    """Smallest size of every effect that would have been found, and the next experiment."""

    key: ClassVar[str] = "detectability"
    title: ClassVar[str] = "What could have been seen"
    needs: ClassVar[str] = "the detectability of effects"

    def of_diagnosis(self, diagnosis: Diagnosis) -> dict[str, Any] | None:
        """The table and the experiment."""
        if not diagnosis.detectability and diagnosis.next_experiment is None:
            return None
        return {"rows": diagnosis.detectability, "next": diagnosis.next_experiment}
