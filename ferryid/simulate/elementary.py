"""Elementary functions that give the same bits on every machine.

Those of the standard library and of NumPy differ in the last bit between processors, libraries and vector widths. These use
only what IEEE 754 rounds correctly (+ - * / and square roots), in a fixed order. Each is within 1 unit in the last place.

Every argument is reduced to a small interval, where a polynomial of least largest relative error (Remez, Taylor's for the
terms taken out of it) is enough; what rounding takes off the reduced argument is carried along in a second number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ferryid.compiled import borrowing

Floats = NDArray[np.float64]

INFINITY = float("inf")
NAN = float("nan")

ROUNDING = 6755399441055744.0
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number, up to 2^51."""

TWO_OVER_PI = 0.6366197723675814
HALF_PI_1 = float.fromhex("0x1.921fb54400000p+0")
HALF_PI_2 = float.fromhex("0x1.0b4611a600000p-34")
HALF_PI_3 = float.fromhex("0x1.3198a2e000000p-69")
HALF_PI_4 = float.fromhex("0x1.b839a252049c1p-104")
"""Half of pi in four parts; the first three have 33 bits, so that up to 2^20 times each is exact."""
HALF_PI = 1.5707963267948966
HALF_PI_REST = 6.123233995736766e-17
SIN_1, SIN_2, SIN_3 = -0.16666666666666632, 0.00833333333332242, -0.00019841269829812535
SIN_4, SIN_5, SIN_6 = 2.755731369361387e-06, -2.505075838961468e-08, 1.589681205463324e-10
"""(sin x - x) / x^3 in powers of x^2, |x| <= pi/4."""
COS_1, COS_2, COS_3 = 0.0416666666666666, -0.0013888888888874131, 2.4801587289487036e-05
COS_4, COS_5, COS_6 = -2.7557314353779646e-07, 2.0875723475998155e-09, -1.1359658616588274e-11
"""(cos x - 1 + x^2 / 2) / x^4 in powers of x^2, |x| <= pi/4."""

ONE_OVER_LN_2 = 1.4426950408889634
LN_2_1 = float.fromhex("0x1.62e42fee00000p-1")
LN_2_2 = float.fromhex("0x1.a39ef35793c76p-33")
"""The natural logarithm of 2 in two parts; the first has 32 bits."""
EXP_1, EXP_2, EXP_3, EXP_4 = 0.5, 0.16666666666666685, 0.04166666666666673, 0.008333333333316737
EXP_5, EXP_6, EXP_7, EXP_8 = 0.001388888888885868, 0.00019841269897063126, 2.4801587373367923e-05, 2.755723423308402e-06
EXP_9, EXP_10, EXP_11 = 2.7557233636526483e-07, 2.511224104164663e-08, 2.092686588810082e-09
"""(e^x - 1 - x) / x^2 in powers of x, |x| <= ln(2)/2."""
LOG_1, LOG_2, LOG_3, LOG_4 = 0.6666666666666734, 0.3999999999941438, 0.28571428742460925, 0.2222219856500889
LOG_5, LOG_6, LOG_7 = 0.18183564781853154, 0.15314038150819384, 0.14796080869365447
"""(ln((1 + s) / (1 - s)) / s - 2) / s^2 in powers of s^2, |s| <= 0.1716."""
ATAN_1, ATAN_2, ATAN_3 = -0.33333333333333287, 0.19999999999781626, -0.14285713951337597
ATAN_4, ATAN_5 = 0.1111088760120698, -0.09023035904122202
"""(atan x - x) / x^3 in powers of x^2, |x| <= 3.5/64."""

SPLIT = 134217729.0
"""2^27 + 1, which divides a number into two of 26 bits (Veltkamp)."""
ATAN_STEPS = 64
SMALLEST_EXP, LARGEST_EXP = -708.0, 709.7
SO_FLAT = 4e-9
"""A slope up to which its arctangent is the slope itself."""
TINY, HUGE = 1e-280, 1e280
GREAT = 2.0**900


def _arctangents() -> Floats:
    """Return atan(k / ATAN_STEPS), k = 0 ... ATAN_STEPS, and what rounding took off it, shape (k, 2).

    Euler's series ``x/(1+x²) Σ_n Π_(j<=n) 2j/(2j+1) x²/(1+x²)`` in whole multiples of 2^-200.
    """
    table = np.empty((ATAN_STEPS + 1, 2))
    one = 1 << 200
    for k in range(ATAN_STEPS + 1):
        square = k * k + ATAN_STEPS * ATAN_STEPS
        term = one * k * ATAN_STEPS // square
        total, n = 0, 0
        while term:
            total += term
            n += 1
            term = term * (2 * n * k * k) // ((2 * n + 1) * square)
        table[k, 0] = total / one
        numerator, denominator = table[k, 0].as_integer_ratio()
        table[k, 1] = (total * denominator - numerator * one) / (denominator * one)
    return table


ARCTANGENTS = _arctangents()


@borrowing
def sin_cos(x: float) -> tuple[float, float]:
    """Return sine and cosine of an angle [rad] of at most 1e6, at little more than the price of one."""
    n = (x * TWO_OVER_PI + ROUNDING) - ROUNDING
    # x - n pi/2 = high + low: differences of which the rounding is found and kept (Knuth).
    a = x - n * HALF_PI_1
    w = n * HALF_PI_2
    b = a - w
    back = b - a
    low = (a - (b - back)) - (w + back)
    w = n * HALF_PI_3
    high = b - w
    back = high - b
    low += (b - (high - back)) - (w + back)
    low -= n * HALF_PI_4
    z = high * high
    zz = z * z
    odd = (SIN_1 + z * SIN_2) + zz * ((SIN_3 + z * SIN_4) + zz * (SIN_5 + z * SIN_6))
    even = (COS_1 + z * COS_2) + zz * ((COS_3 + z * COS_4) + zz * (COS_5 + z * COS_6))
    half = 0.5 * z
    s = high + (high * z * odd + low * (1.0 - half))
    c = 1.0 - half
    c = c + (((1.0 - c) - half) + (zz * even - high * low))
    quadrant = n - 4.0 * ((0.25 * n - 0.375 + ROUNDING) - ROUNDING)
    if quadrant == 1.0 or quadrant == 3.0:
        s, c = c, s
    if quadrant >= 2.0:
        s = -s
    if quadrant == 1.0 or quadrant == 2.0:
        c = -c
    return s, c


@borrowing
def sin(x: float) -> float:
    """Return the sine of an angle [rad] of at most 1e6."""
    return sin_cos(x)[0]


@borrowing
def cos(x: float) -> float:
    """Return the cosine of an angle [rad] of at most 1e6."""
    return sin_cos(x)[1]


@borrowing
def exp(x: float) -> float:
    """Return e to the power x; 0 below -708 and infinity above 709.7, near the ends of what numbers can be."""
    if not SMALLEST_EXP <= x <= LARGEST_EXP:
        return 0.0 if x < SMALLEST_EXP else INFINITY if x > LARGEST_EXP else NAN
    n = (x * ONE_OVER_LN_2 + ROUNDING) - ROUNDING
    a = x - n * LN_2_1
    w = n * LN_2_2
    r = a - w
    low = (a - r) - w
    z = r * r
    zz = z * z
    p = (EXP_1 + r * EXP_2) + z * (EXP_3 + r * EXP_4)
    p += zz * ((EXP_5 + r * EXP_6) + z * (EXP_7 + r * EXP_8) + zz * (EXP_9 + r * EXP_10 + z * EXP_11))
    value = 1.0 + (r + (low + z * p))
    # 2^n by its bits; in two halves, since 2^1024 is no number.
    half = np.int64(n) >> 1
    rest = np.int64(n) - half
    return float(
        value * np.int64((half + 1023) << 52).view(np.float64) * np.int64((rest + 1023) << 52).view(np.float64)
    )


@borrowing
def log(x: float) -> float:
    """Return the natural logarithm of x > 0."""
    if not 0.0 < x < INFINITY:
        return -INFINITY if x == 0.0 else INFINITY if x > 0.0 else NAN
    shift = 0
    if x < TINY:
        x *= GREAT
        shift = -900
    # x = 2^n m with m between sqrt(1/2) and sqrt(2): 0x3fe6a09e... are the bits of sqrt(1/2).
    bits = np.float64(x).view(np.int64)
    n = (bits - 0x3FE6A09E667F3BCD) >> 52
    m = np.int64(bits - (n << 52)).view(np.float64)
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    zz = z * z
    p = z * ((LOG_1 + z * LOG_2) + zz * ((LOG_3 + z * LOG_4) + zz * ((LOG_5 + z * LOG_6) + zz * LOG_7)))
    half = 0.5 * f * f
    scale = float(n + shift)
    return float(scale * LN_2_1 - ((half - (s * (half + p) + scale * LN_2_2)) - f))


@borrowing
def atan2(y: float, x: float) -> float:
    """Return the angle of the point (x, y) [rad], in [-pi, pi]; 0 for the origin. Zeros have no sign."""
    across, along = abs(y), abs(x)
    steep = across > along
    if steep:
        across, along = along, across
    if not along < INFINITY:
        return NAN
    if along == 0.0:
        return 0.0
    if not TINY < along < HUGE:
        scale = GREAT if along < 1.0 else 1.0 / GREAT
        across, along = across * scale, along * scale
    # atan(t) = atan(c) + atan((t - c) / (1 + c t)) with c = k/64 next to t.
    t = across / along
    k = int(t * ATAN_STEPS + 0.5)
    swollen = SPLIT * along
    upper = swollen - (swollen - along)
    lower = along - upper
    if k < 4:
        swollen = SPLIT * t
        left = swollen - (swollen - t)
        right = t - left
        rest = (((across - left * upper) - left * lower) - right * upper) - right * lower
        high, low, t_low = t, 0.0, rest / along if t > SO_FLAT else 0.0
    else:
        c = k / ATAN_STEPS
        t = ((across - c * upper) - c * lower) / (along + c * across)
        high, low, t_low = ARCTANGENTS[k, 0], ARCTANGENTS[k, 1] + t, 0.0
    z = t * t
    low += t_low + t * z * ((ATAN_1 + z * ATAN_2) + z * z * ((ATAN_3 + z * ATAN_4) + z * z * ATAN_5))
    if steep:
        total = HALF_PI - high
        low = ((HALF_PI - total) - high) + (HALF_PI_REST - low)
        high = total
    if x < 0.0:
        total = 2.0 * HALF_PI - high
        low = ((2.0 * HALF_PI - total) - high) + (2.0 * HALF_PI_REST - low)
        high = total
    angle = high + low
    return -angle if y < 0.0 else angle


def sines_cosines(angles: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine of angles [rad], each of shape (n,)."""
    sines, cosines = np.empty(len(angles)), np.empty(len(angles))
    _sines_cosines(angles, sines, cosines)
    return sines, cosines


@borrowing
def _sines_cosines(angles: Floats, sines: Floats, cosines: Floats) -> None:
    for i in range(len(angles)):
        sines[i], cosines[i] = sin_cos(angles[i])


def directions(y: Floats, x: Floats) -> Floats:
    """Return the angles of points (x, y) [rad], shape (n,)."""
    out = np.empty(len(x))
    _directions(y, x, out)
    return out


@borrowing
def _directions(y: Floats, x: Floats, out: Floats) -> None:
    for i in range(len(out)):
        out[i] = atan2(y[i], x[i])
