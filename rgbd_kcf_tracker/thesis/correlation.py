# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""The kernelized correlation filter: kernel ridge regression over all cyclic shifts of a patch.

Training on every shift of one patch makes the kernel matrix circulant, so the regression is solved
and evaluated with a few Fourier transforms (Henriques et al. 2015; thesis section 2.2, equations 18
to 27 and 32). A filter holds what it has learned; where to look and when to learn is the tracker's
business.

Features are ``(channels, rows, cols)`` arrays, already windowed (:func:`cosine_window`) and, where
wanted, masked: cells multiplied by 0 take no part. Responses are ``(rows, cols)`` with the zero
shift at ``[0, 0]``; negative shifts wrap round, see :func:`peak`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import fft

Real = npt.NDArray[np.floating[Any]]
Spectrum = npt.NDArray[np.complexfloating[Any, Any]]

GAUSSIAN = 'gaussian'
LINEAR = 'linear'
KERNELS = (GAUSSIAN, LINEAR)

# Responses closer than this are equal but for rounding.
_TIE = 1e-9


def cosine_window(shape: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Separable Hann window, zero on the border, against the wrap-round of the cyclic shifts.

    Args:
        shape: rows and columns of cells.

    Returns:
        ``(rows, cols)`` float32, 0 to 1.
    """
    window = np.hanning(shape[0])[:, None] * np.hanning(shape[1])[None, :]
    return window.astype(np.float32)


def spectrum(features: Real) -> Spectrum:
    """Half spectrum over the last two axes (real input, so the other half is its mirror).

    Args:
        features: ``(..., rows, cols)``, of one patch or a stack of them.

    Returns:
        ``(..., rows, cols // 2 + 1)`` complex.
    """
    transformed: Spectrum = fft.rfft2(features, axes=(-2, -1))
    return transformed


def _energy(features: Real) -> Real:
    """Squared norm of each ``(channels, rows, cols)`` patch of a stack."""
    return np.asarray(np.einsum('...crx,...crx->...', features, features, dtype=np.float64))


def _spectral_energy(xf: Spectrum, shape: tuple[int, int]) -> Real:
    """Squared norm of a patch from its half spectrum (Parseval)."""
    flat = xf.ravel()
    # Every column but the first, and the last of an even width, stands for its mirror too.
    alone = xf[:, :, :1] if shape[1] % 2 else xf[:, :, [0, -1]]
    once = np.vdot(alone, alone).real
    return np.asarray((2 * np.vdot(flat, flat).real - once) / (shape[0] * shape[1]))


def _cross(xf: Spectrum, zf: Spectrum, shape: tuple[int, int]) -> npt.NDArray[np.float64]:
    """Cyclic cross-correlation of x with z, summed over channels: ``sum_s x[s] z[s + shift]``."""
    summed = np.einsum('crx,...crx->...rx', np.conj(xf), zf)
    # One plane from here on: double precision costs little, and the regularisation is small.
    product: npt.NDArray[np.float64] = fft.irfft2(
        summed.astype(np.complex128), s=shape, axes=(-2, -1)
    )
    return product


def gaussian_correlation(x: Real, z: Real, sigma: float) -> npt.NDArray[np.float64]:
    """Gaussian kernel of ``z`` at all cyclic shifts with ``x`` (thesis equation 32).

    The squared distance is divided by the number of elements, as every implementation does; the
    thesis's printed equation leaves it out.

    Args:
        x: ``(channels, rows, cols)``.
        z: ``(channels, rows, cols)``, or a stack ``(n, channels, rows, cols)``.
        sigma: bandwidth, in units of the root mean square difference per element.

    Returns:
        ``(rows, cols)``, or ``(n, rows, cols)`` for a stack.
    """
    return _gaussian(spectrum(x), _energy(x), spectrum(z), _energy(z), x.shape, sigma)


def _gaussian(
    xf: Spectrum,
    x_energy: Real,
    zf: Spectrum,
    z_energy: Real,
    size: tuple[int, ...],
    sigma: float,
) -> npt.NDArray[np.float64]:
    cross = _cross(xf, zf, (size[-2], size[-1]))
    elements = size[-3] * size[-2] * size[-1]
    distance = (x_energy + z_energy)[..., None, None] - 2 * cross
    # Rounding can make the distance of equal patches a little negative.
    np.maximum(distance, 0, out=distance)
    kernel: npt.NDArray[np.float64] = np.exp(distance * (-1 / (sigma**2 * elements)))
    return kernel


def linear_correlation(x: Real, z: Real) -> npt.NDArray[np.float64]:
    """Dot product of ``z`` at all cyclic shifts with ``x``, divided by the number of elements.

    Shapes as in :func:`gaussian_correlation`.
    """
    cross = _cross(spectrum(x), spectrum(z), (x.shape[-2], x.shape[-1]))
    scaled: npt.NDArray[np.float64] = cross / (x.shape[-3] * x.shape[-2] * x.shape[-1])
    return scaled


class Peak(NamedTuple):
    """The highest point of a response.

    Attributes:
        row: shift of the highest cell, positive downwards.
        col: shift of the highest cell, positive to the right.
        value: the response there.
        fine_row: shift in cells with sub-cell precision.
        fine_col: likewise.
    """

    row: int
    col: int
    value: float
    fine_row: float
    fine_col: float


def peak(response: Real) -> Peak:
    """Where the response is highest, refined by a parabola through the neighbours on each axis.

    Where nothing is higher than the zero shift beyond rounding, as in a featureless window, that is
    the answer.
    """
    rows, cols = response.shape
    index = int(np.argmax(response))
    row, col = divmod(index, cols)
    top = float(response[row, col])
    if top - float(response[0, 0]) <= _TIE * max(1.0, abs(top)):
        row = col = 0
        top = float(response[0, 0])
    if top - float(response.min()) <= _TIE * max(1.0, abs(top)):
        return Peak(0, 0, top, 0.0, 0.0)
    row_offset = _vertex(float(response[row - 1, col]), top, float(response[(row + 1) % rows, col]))
    col_offset = _vertex(float(response[row, col - 1]), top, float(response[row, (col + 1) % cols]))
    if row > rows // 2:
        row -= rows
    if col > cols // 2:
        col -= cols
    return Peak(row, col, top, row + row_offset, col + col_offset)


def _vertex(before: float, top: float, after: float) -> float:
    """Offset of a parabola's vertex from its middle sample, -0.5 to 0.5."""
    curvature = before - 2 * top + after
    if not curvature < 0:
        return 0.0
    return float(np.clip((before - after) / (2 * curvature), -0.5, 0.5))


@dataclass(frozen=True)
class Sample:
    """A patch made ready for the filter once, for use in both detection and training.

    Attributes:
        spectrum: ``(channels, rows, cols // 2 + 1)``, or a stack of these.
        energy: squared norm of the patch, or of each of the stack.
        size: channels, rows, cols.
    """

    spectrum: Spectrum
    energy: Real
    size: tuple[int, int, int]

    @classmethod
    def of(cls, features: Real) -> Sample:
        """The sample of ``(channels, rows, cols)`` features, or of a stack ``(n, ...)``."""
        channels, rows, cols = features.shape[-3:]
        return cls(spectrum(features), _energy(features), (channels, rows, cols))


class CorrelationFilter:
    """A regression learned from patches of one size, and evaluated at all shifts of others.

    Args:
        labels: ``(rows, cols)`` targets with the peak at ``[0, 0]``, see
            :func:`~rgbd_kcf_tracker.features.labels.gaussian_labels`.
        regularization: lambda of the ridge regression.
        kernel: ``'gaussian'`` or ``'linear'``.
        kernel_sigma: bandwidth of the Gaussian kernel; not used by the linear one.

    Raises:
        ValueError: for an unknown kernel.
    """

    def __init__(
        self,
        labels: Real,
        *,
        regularization: float = 1e-4,
        kernel: str = GAUSSIAN,
        kernel_sigma: float = 0.5,
    ) -> None:
        if kernel not in KERNELS:
            raise ValueError(f'unknown kernel {kernel!r}: choose one of {", ".join(KERNELS)}')
        self._shape = (labels.shape[0], labels.shape[1])
        self._labels = spectrum(labels.astype(np.float64))
        self._regularization = regularization
        self._kernel = kernel
        self._sigma = kernel_sigma
        self._alpha: Spectrum | None = None
        self._template: Spectrum | None = None
        self._energy: Real = np.zeros(())

    @property
    def trained(self) -> bool:
        """Whether anything has been learned."""
        return self._alpha is not None

    def learn(self, sample: Sample, rate: float = 1.0) -> None:
        """Move the filter towards the regression on one sample (thesis equations 24, 28).

        Coefficients and template are interpolated, each by ``rate``; the first sample, or a rate of
        1, is taken whole.

        Args:
            sample: one patch, whose target is at the zero shift.
            rate: 0 to 1.
        """
        kernel = self._correlate(sample.spectrum, sample.energy, sample)
        alpha = self._labels / (spectrum(kernel) + self._regularization)
        if self._alpha is None or self._template is None or rate >= 1:
            self._alpha, self._template, self._energy = alpha, sample.spectrum, sample.energy
            return
        self._alpha = (1 - rate) * self._alpha + rate * alpha
        step = sample.spectrum - self._template
        step *= np.float32(rate)
        self._template = self._template + step
        self._energy = _spectral_energy(self._template, self._shape)

    def respond(self, sample: Sample) -> npt.NDArray[np.float64]:
        """The response at all shifts of a patch, or of each of a stack (thesis equations 25, 27).

        Returns:
            ``(rows, cols)``, or ``(n, rows, cols)``.

        Raises:
            ValueError: before anything was learned.
        """
        if self._alpha is None or self._template is None:
            raise ValueError('the filter has learned nothing yet')
        kernel = self._correlate(self._template, self._energy, sample)
        response: npt.NDArray[np.float64] = fft.irfft2(
            spectrum(kernel) * self._alpha, s=self._shape, axes=(-2, -1)
        )
        return response

    def copy(self) -> CorrelationFilter:
        """A filter that goes on from the same state without touching this one."""
        twin = CorrelationFilter.__new__(CorrelationFilter)
        twin.__dict__.update(self.__dict__)
        return twin

    def _correlate(self, xf: Spectrum, energy: Real, z: Sample) -> npt.NDArray[np.float64]:
        if self._kernel == GAUSSIAN:
            return _gaussian(xf, energy, z.spectrum, z.energy, z.size, self._sigma)
        channels, rows, cols = z.size
        return _cross(xf, z.spectrum, self._shape) / (channels * rows * cols)
