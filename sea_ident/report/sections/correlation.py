"""How far the estimates depend on each other."""

from typing import Any, ClassVar

import numpy as np

from sea_ident.estimation import Model
from sea_ident.report.content import Content
from sea_ident.report.matrix import matrix
from sea_ident.report.section import ModelSection

STRONG = 0.9


class Correlation(ModelSection):
    """Correlation of the base parameters by the motion (paper, eq. 13), and the pairs that can hardly be told apart."""

    key: ClassVar[str] = "correlation"
    title: ClassVar[str] = "Correlation of the parameters"
    needs: ClassVar[str] = "a covariance"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """The matrix as a picture, and the strongest pairs."""
        # that of the spread between a few periods has hardly more directions than there are periods
        covariance = model.model_covariance
        std = np.sqrt(np.diag(covariance))
        if not np.all(std > 0.0) or not np.all(np.isfinite(covariance)):
            return None
        correlation = covariance / np.outer(std, std)
        names = model.base.names
        rows, columns = np.triu_indices(len(names), 1)
        order = np.argsort(-np.abs(correlation[rows, columns]))[:6]
        pairs = [(names[rows[k]], names[columns[k]], float(correlation[rows[k], columns[k]])) for k in order]
        tips = [[f"{a}\n{b}\n{correlation[i, j]:+.3f}" for j, b in enumerate(names)] for i, a in enumerate(names)]
        return {
            "matrix": matrix(correlation, names, names, tips, "Correlation matrix"),
            "pairs": pairs,
            "strong": [pair for pair in pairs if abs(pair[2]) > STRONG],
            "limit": STRONG,
        }
