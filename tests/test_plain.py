"""Numbers for people."""

import pytest

from sea_ident.plain import plain


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (410.4, 2, "410"), (99.6, 2, "100"), (12345.0, 3, "12300"), (1.0, 2, "1"), (0.0523, 2, "0.052"),
        (-131.0, 2, "-130"), (0.0, 2, "0"), (3e-7, 2, "3e-07"), (float("inf"), 2, "inf"), (float("nan"), 2, "nan"),
    ],
)  # fmt: skip
def test_large_numbers_have_no_exponent(value, digits, text):
    assert plain(value, digits) == text
