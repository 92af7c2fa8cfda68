"""The closed form for HUBO's family against EAIK, an independent solver."""

import numpy as np
import pytest

from fv_robot_model.ik import SerialChain, make_ik_solver, make_numerical_ik_solver

eaik = pytest.importorskip("eaik.IK_HP", reason="EAIK is not installed")


def hubo_like_chain() -> SerialChain:
    shoulder = np.array([0.0123, -0.211, 0.0486])
    offsets = [[0, 0, 0]] * 3 + [[0.022, 0.018, -0.182], [0, 0, -0.2934], [0, 0.01, -0.346]]
    T_zero = np.eye(4)
    T_zero[:3, :3] = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
    T_zero[:3, 3] = shoulder - np.array([0.0, 0.0, 0.4785])
    return SerialChain(
        axes=np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0]], float),
        points=shoulder + np.array(offsets, float),
        lower=np.full(6, -np.pi),
        upper=np.full(6, np.pi),
        T_zero=T_zero,
    )


def eaik_solutions(chain: SerialChain, T: np.ndarray) -> np.ndarray:
    points = chain.points
    offsets = np.vstack([points[0], np.diff(points, axis=0), chain.T_zero[:3, 3] - points[-1]])
    pose = T.copy()
    pose[:3, :3] = T[:3, :3] @ chain.T_zero[:3, :3].T
    answer = eaik.HPRobot(chain.axes, offsets).IK(pose)
    exact = [q for q, approximate in zip(answer.Q, answer.is_LS, strict=True) if not approximate]
    return np.array(exact).reshape(-1, 6)


def same_set(ours: np.ndarray, theirs: np.ndarray, tolerance: float = 1e-5) -> bool:
    if len(ours) != len(theirs):
        return False
    apart = np.abs(np.angle(np.exp(1j * (ours[:, None] - theirs[None])))).max(axis=2, initial=0.0)
    return bool(
        (apart.min(axis=1, initial=9.0) < tolerance).all()
        and (apart.min(axis=0, initial=9.0) < tolerance).all()
    )


def test_same_solutions_as_eaik_on_reachable_and_random_poses():
    chain = hubo_like_chain()
    solver = make_ik_solver(chain)
    random = np.random.default_rng(0)
    reachable = chain.forward(random.uniform(-np.pi, np.pi, (300, 6)))
    moved = reachable.copy()
    moved[:, :3, 3] += random.uniform(-0.2, 0.2, (300, 3))
    poses = np.concatenate([reachable, moved])
    offsets, joints = solver.solve(poses)
    different = [
        i
        for i, T in enumerate(poses)
        if not same_set(joints[offsets[i] : offsets[i + 1]], eaik_solutions(chain, T))
    ]
    assert different == []
    assert (np.diff(offsets)[:300] > 0).all()


def test_the_numerical_solver_agrees_where_it_finds_something():
    chain = hubo_like_chain()
    poses = chain.forward(np.random.default_rng(1).uniform(-2, 2, (20, 6)))
    exact_offsets, exact = make_ik_solver(chain).solve(poses)
    offsets, joints = make_numerical_ik_solver(chain).solve(poses)
    assert (np.diff(offsets) > 0).mean() > 0.9
    for i in range(len(poses)):
        known = exact[exact_offsets[i] : exact_offsets[i + 1]]
        for q in joints[offsets[i] : offsets[i + 1]]:
            assert np.abs(np.angle(np.exp(1j * (known - q)))).max(axis=1).min() < 1e-4


def test_bad_shapes_are_named():
    chain = hubo_like_chain()
    with pytest.raises(ValueError, match=r"\(N, 4, 4\)"):
        make_ik_solver(chain).solve(np.eye(4))
    with pytest.raises(ValueError, match="pose 0"):
        make_ik_solver(chain).solve(np.full((1, 4, 4), np.nan))
    with pytest.raises(ValueError, match=r"\(N, 6\)"):
        chain.forward(np.zeros((2, 5)))
