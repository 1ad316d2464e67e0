"""Numbers for people."""


def plain(value: float, digits: int = 2) -> str:
    """A number with so many significant digits, and no exponent where it is large: 410, not 4.1e+02."""
    return f"{float(f'{value:.{digits}g}'):.15g}"
