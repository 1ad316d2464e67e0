"""What a section of a report is: one class, one template."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.estimation import Model
from sea_ident.report.content import Content


class Section(ABC):
    """A section of the report; subclasses live in one file each, beside a template of the same name.

    Attributes:
        key: name of the module, of the template and of the anchor in the page.
        title: heading.
        needs: what has to be given for it to appear, in words.
    """

    key: ClassVar[str]
    title: ClassVar[str]
    needs: ClassVar[str]

    @abstractmethod
    def context(self, content: Content) -> dict[str, Any] | None:
        """What its template shows; None where `needs` is not met."""


class ModelSection(Section):
    """A section about the model."""

    def context(self, content: Content) -> dict[str, Any] | None:
        """What its template shows; None where there is no model, or `needs` is not met."""
        return None if content.model is None else self.of_model(content.model, content)

    @abstractmethod
    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """What its template shows; None where `needs` is not met."""


class DiagnosisSection(Section):
    """A section about what the model lacks."""

    def context(self, content: Content) -> dict[str, Any] | None:
        """What its template shows; None where there is no diagnosis, or `needs` is not met."""
        return None if content.diagnosis is None else self.of_diagnosis(content.diagnosis)

    @abstractmethod
    def of_diagnosis(self, diagnosis: Diagnosis) -> dict[str, Any] | None:
        """What its template shows; None where `needs` is not met."""
