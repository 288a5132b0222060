"""Which of several models cannot be told from the best one, from errors on the same blocks of rows.

Errors are compared block by block, so that what is hard for all of them cancels. The best is picked by the same errors that the
others are compared with, and there are many pairs to compare: both are counted in, by drawing the largest of all differences.
"""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats

ALIKE = 1e-9
"""Scores that differ by less than this part are the same."""


def model_confidence_set(scores: Floats, drawn: Floats, blocks: int) -> Floats:
    """Return for each model the p-value of "no other is better", shape (S,); one of them has 1.

    All models are held to be equally good until the largest difference between two, over its standard error, is larger than in
    all but a part p of the draws. The model that it speaks against is left out, and so on: those with p above 0.05 hold the
    best with 95 % certainty.

    Parameters
    ----------
    scores
        Error of each model, shape (S,); less is better.
    drawn
        The same of blocks drawn again with replacement, shape (draws, S).
    blocks
        Number of blocks. Of few, the draws scatter too little; they are moved out as Student's t is.

    References
    ----------
    Hansen, Lunde and Nason (2011), The Model Confidence Set, Econometrica 79, 453-497, with the range statistic.
    """
    from scipy.special import stdtrit  # a tenth of a second to import: only where it is needed

    wider = np.sqrt(blocks / (blocks - 1)) * stdtrit(blocks - 1, 0.975) / 1.959964
    deviations = (drawn - scores) * wider
    left = np.arange(len(scores))
    p, highest = np.ones(len(scores)), 0.0
    while len(left) > 1:
        behind = scores[left][:, None] - scores[left]
        scatter = deviations[:, left][:, :, None] - deviations[:, left][:, None, :]
        error = np.sqrt((scatter**2).mean(axis=0))
        # Two models of one form differ by rounding alone.
        error[np.abs(behind) <= ALIKE * np.abs(scores[left]).max()] = np.inf
        largest = (np.abs(scatter) / error).max(axis=(1, 2))
        found = (behind / error).max(axis=1)
        worst = int(np.argmax(found))
        highest = max(highest, float(np.mean(largest >= found[worst])))
        p[left[worst]] = highest
        left = np.delete(left, worst)
    return p
