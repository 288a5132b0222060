"""Motions made in memory for tests: a known hull, moved along by sums of sines."""

from __future__ import annotations

from dataclasses import replace
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.stream import Recording
from ferryid.signals.track import Motion
from ferryid.vessel import load_profile
from ferryid.vessel.hull import inverse_dynamics

Floats = NDArray[np.float64]

PROFILE = load_profile("milliampere")
RATE_HZ = 10.0


def motion(
    seed: int, *, seconds: float = 240.0, noise: float = 0.0, sizes: tuple[float, float, float] = (0.8, 0.4, 0.15)
) -> Motion:
    """Return a motion whose force is the profile's hull's, with noise of `noise` [N, N, N·m]."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    omega = 2.0 * np.pi * rng.uniform(0.01, 0.1, (3, 5))
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, 5))
    size = np.array(sizes)[:, None] / np.arange(1.0, 6.0)
    angles = omega[:, :, None] * t + phase[:, :, None]
    nu = np.sum(size[:, :, None] * np.sin(angles), axis=1).T
    nu_dot = np.sum((size * omega)[:, :, None] * np.cos(angles), axis=1).T
    psi = np.sum((size / omega)[:, :, None] * -np.cos(angles), axis=1)[2]
    tau = inverse_dynamics(PROFILE.hull, nu_dot, nu, None) + noise * rng.standard_normal(nu.shape)
    eta = np.column_stack([np.zeros((len(t), 2)), psi])
    return Motion(f"round {seed}", t, RATE_HZ, eta, nu, nu_dot, tau, np.ones(len(t), dtype=bool), nu)


def with_flow(made: Motion, seed: int) -> Motion:
    """Return the motion with a measured wind and current that turn."""
    turn = np.random.default_rng(seed).uniform(0.0, 6.0) + 0.01 * made.t
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    return replace(made, wind=6.0 * around, current=0.3 * around[:, ::-1])


def recorded_as(recording: Recording, name: str) -> Recording:
    """Return a recording under another name, with samples of its own: it is no copy of the one that it was made of."""
    factor = 1.0 + 1e-3 * (1 + crc32(name.encode()) % 1000)
    streams = {
        topic: replace(stream, columns={column: factor * values for column, values in stream.columns.items()})
        for topic, stream in recording.streams.items()
    }
    return replace(recording, name=name, sha256=name, files=(name,), streams=streams)
