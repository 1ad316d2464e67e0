"""Samples that are left out say nothing about a model, whatever happens in them."""

import numpy as np

from sea_ident.discrepancy.bench.free_samples import free_samples
from sea_ident.discrepancy.measured.data import ALIKE, BARELY_SEEN, spectrum
from sea_ident.discrepancy.measured.noise import stacked


def test_what_happens_between_samples_left_out_is_taken_up_where_a_model_is_judged():
    """A jump between two samples, its mean and slope taken up: what is left is a weak combination of four samples."""
    left_out = np.zeros((400, 1), dtype=bool)
    left_out[100:104] = True
    jump = np.zeros((400, 1))
    jump[100:104, 0] = [1.0, -3.0, 3.0, -1.0]
    seen = stacked(spectrum(jump, 60))
    left = []
    for alike in (ALIKE, BARELY_SEEN):
        columns = stacked(free_samples(left_out, 60, alike))
        amounts = np.linalg.lstsq(columns, seen, rcond=None)[0]
        left.append(np.linalg.norm(seen - columns @ amounts) / np.linalg.norm(seen))
    assert left[0] > 0.3
    assert left[1] < 1e-2


def test_columns_that_take_up_what_is_left_out_are_orthonormal_each_in_its_equation():
    """Runs two samples apart look alike within the band; in every noise floor it would have to be found out again."""
    left_out = np.zeros((400, 2), dtype=bool)
    left_out[[*range(0, 12), *range(14, 30), *range(390, 400)], 1] = True
    left_out[200:203, 0] = True
    found = free_samples(left_out, 60, BARELY_SEEN)
    columns = stacked(found)
    np.testing.assert_allclose(columns.T @ columns, np.eye(columns.shape[1]), atol=1e-12)
    assert np.all(np.any(found, axis=0).sum(axis=0) == 1)
    for row in np.argwhere(left_out):
        sample = np.zeros((400, 2))
        sample[tuple(row)] = 1.0
        seen = stacked(spectrum(sample, 60))
        assert np.linalg.norm(seen - columns @ (columns.T @ seen)) < 1e-2 * np.linalg.norm(seen)


def test_nothing_left_out_takes_nothing_up():
    assert free_samples(np.zeros((40, 3), dtype=bool), 10).shape == (11, 3, 0)
