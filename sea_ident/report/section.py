"""What a section of a report is: one class, one template."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

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
