"""Loopy belief propagation over the factor graph of the joint decision, several runs at once.

Doi 10.1109/18.910572. The evidence is turned up over the first iterations, from random first weights. A run ends once
its beliefs stand still.
"""

from __future__ import annotations

import numpy as np

from .factorgraph import LEAST, Graph, Problem
from .values import Float, Float32

DAMPING = np.float32(0.35)
STILL = 1e-4  # change of every belief


def propagate(graph: Graph, log_prior: Float, jitter: Float, iterations: int, ramp: int) -> Float:
    """M runs that differ in their priors or their first weights.

    Args:
        log_prior: (H, M), nats. jitter: (H, M), nats, what a run's hypotheses are favoured by while the evidence is
            turned up. ramp: iterations over which it is.

    Returns:
        (H, M), log weight of each hypothesis.
    """
    p = graph.problem
    out, running = np.array(log_prior), np.arange(log_prior.shape[1])
    message = np.zeros((len(p.state_prior), len(graph.pair_rod), len(running)), np.float32)
    belief, look, room = np.zeros(0), np.zeros(0, np.float32), np.zeros(0, np.float32)
    evidence = np.zeros((0, len(running)), np.float32)
    for step in range(iterations):
        share = min(1.0, (step + 1) / max(1, ramp))
        if step < max(1, ramp):
            look = graph.looks(len(running), share)
            room = room if room.shape == look.shape else np.empty_like(look)
        weight = log_prior[:, running] + (1 - share) * jitter[:, running]
        if len(graph.hypothesis):
            evidence = graph.evidence(message, look, room)
            weight += graph.of_hypotheses(evidence)
        total = weight + _chain_messages(p, weight) if p.ties else weight
        out[:, running] = total
        if share == 1:
            before, belief = belief, graph.normalised(total)
            if before.shape == belief.shape:
                going = np.abs(belief - before).max(axis=0) >= STILL
                if not going.any():
                    break
                if not going.all():
                    running, belief, message = running[going], belief[:, going], message[..., going]
                    total, evidence = total[:, going], evidence[:, going]
                    look, room = graph.looks(len(running)), np.empty((*look.shape[:2], len(running)), np.float32)
        if len(graph.hypothesis):
            told = np.log(np.maximum(_to_rods(graph, total, evidence, look, room), LEAST))
            message *= DAMPING
            message += (1 - DAMPING) * told
    return out


def _to_rods(graph: Graph, total: Float, evidence: Float32, look: Float32, room: Float32) -> Float32:
    """(K, P, M): messages from snapshots to rods; a place that does not see the rod says nothing of it."""
    share = np.exp(total - graph.top(total)[graph.owner])
    with_rod = share.astype(np.float32)[graph.hypothesis]
    of_snapshot = graph.total(share).astype(np.float32)
    without = np.maximum(of_snapshot[graph.pair_snapshot] - graph.of_pairs(with_rod), 0)
    cavity = with_rod * np.exp(-np.minimum(np.maximum(evidence, -60), 60))
    seen = np.stack([graph.of_pairs(of_state) for of_state in np.multiply(cavity, look, out=room)])
    seen += without
    seen /= graph.of_pairs(cavity) + without + LEAST
    return seen


def _chain_messages(p: Problem, weight: Float) -> Float:
    """(H, M): what its neighbours in time say of each hypothesis, by a forward and a backward pass over the ties."""
    forward, backward = np.zeros_like(weight), np.zeros_like(weight)
    for t in p.ties:
        a, b = slice(p.start[t.first], p.start[t.first + 1]), slice(p.start[t.second], p.start[t.second + 1])
        forward[b] = _log_sum((weight[a] + forward[a])[:, None] + t.log_factor[..., None], 0)
    for t in reversed(p.ties):
        a, b = slice(p.start[t.first], p.start[t.first + 1]), slice(p.start[t.second], p.start[t.second + 1])
        backward[a] = _log_sum((weight[b] + backward[b])[None] + t.log_factor[..., None], 1)
    return forward + backward


def _log_sum(x: Float, axis: int) -> Float:
    top = x.max(axis=axis, keepdims=True)
    total = np.log(np.exp(x - top).sum(axis=axis)) + top.squeeze(axis)
    return np.asarray(total - total.max(axis=0))
