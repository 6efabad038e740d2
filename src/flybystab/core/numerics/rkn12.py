"""RKN12(10), the explicit Runge-Kutta-Nyström method of Dormand, El-Mikkawy & Prince for x'' = a(t, x, x').

Dormand, El-Mikkawy & Prince (1987), IMA Journal of Numerical Analysis 7, 423. With the stages

    x_s = x + c_s h v + h^2 sum_j A_sj a_j,    v_s = v + h sum_j V_sj a_j,    a_s = a(t + c_s h, x_s, v_s)

the solution at t + h is ``x + h v + h^2 sum b_j a_j``, ``v + h sum b'_j a_j``, of order 12 where a does not depend on
the velocity. The method itself has no velocities of the stages. Those here integrate polynomials in time exactly, of
degree 5 from the seventh stage on, which is enough for accelerations that depend weakly on the velocity (relativity:
1e-8 of the attraction by the Sun). The sums over stages are inlined into their callers.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import inlined
from flybystab.core.numerics.lanes import lane, lanes_at, spread
from flybystab.typing import Array

#: Stages of a step; the rate at its end is one more.
N_STAGES = 17
#: The estimated error of a step is proportional to the step size to this power.
ERROR_ORDER = 11
#: Moments of the velocity stages: largest number of powers of time that they integrate exactly.
_MOMENTS = 6

# c; the rows of A below its diagonal; b and b'; and their differences from the embedded method of order 10.
# fmt: off
_NODES = (
    0, 1 / 50, 1 / 25, 1 / 10, 2 / 15, 4 / 25, 1 / 20, 1 / 5, 1 / 4, 1 / 3, 1 / 2, 5 / 9, 3 / 4, 6 / 7, 8437 / 8926,
    1, 1,
)
_A = (
    0.0002,
    0.0002666666666666667, 0.0005333333333333334,
    0.002916666666666667, -0.004166666666666667, 0.00625,
    0.0016460905349794238, 0.0, 0.0054869684499314125, 0.0017558299039780521,
    0.0019456, 0.0, 0.007151746031746032, 0.0029127111111111113, 0.0007899428571428571,
    0.00056640625, 0.0, 0.0008809730489417989, -0.0004369212962962963, 0.00033900669642857143, -9.946469907407407e-05,
    0.0030833333333333333, 0.0, 0.0, 0.0017777777777777779, 0.0027, 0.0015782828282828283, 0.01086060606060606,
    0.00365183937480113, 0.0, 0.003965171714072343, 0.0031972582629306284, 0.008221467306855435,
    -0.0013130926959572379, 0.009771586968064868, 0.003755769069232834,
    0.003707241068718501, 0.0, 0.005082045854555286, 0.001174708002175412, -0.021147629915126993, 0.06010463698107881,
    0.02010573476850619, -0.02835075012293358, 0.014879568918581932,
    0.03512537656073344, 0.0, -0.008615749195138479, -0.005791448051007917, 1.945554823782616, -3.4351238674565137,
    -0.10930701107475221, 2.3496383118995166, -0.7560094086870229, 0.10952897222156927,
    0.020527792537482496, 0.0, -0.00728644676448018, -0.0021153556079618403, 0.9275807968723522, -1.6522824844257367,
    -0.02107956300568657, 1.2065364326207872, -0.4137144770010661, 0.09079873982809654, 0.005355552600533985,
    -0.14324078875545515, 0.0, 0.012528703773091817, 0.006826019163969827, -4.799555395574387, 5.6986250439519415,
    0.7553430369523645, -0.12755487858281084, -1.9605926051117384, 0.9185609056635262, -0.23880085505284432,
    0.15911081357234216,
    0.8045019205520489, 0.0, -0.016658527067011247, -0.021415834042629735, 16.827235928962466, -11.172835357176098,
    -3.377159297226324, -15.243326655360846, 17.179835738215417, -5.437719239823995, 1.3878671618364655,
    -0.5925827732652812, 0.029603873171297354,
    -0.913296766697358, 0.0, 0.0024112725757805178, 0.01765812269386174, -14.851649779720384, 2.1589708670045757,
    3.99791558311788, 28.434151800232232, -25.2593643549416, 7.733878542362238, -1.8913028948478674,
    1.0014845070224718, 0.004641199599109052, 0.011218755022148957,
    -0.27519629720559396, 0.0, 0.03661188877915492, 0.009789519688231562, -12.293062345886211, 14.207226453937903,
    1.5866476906789537, 2.4577735327595946, -8.935193694403273, 4.373672731613407, -1.8347181765449492,
    1.1592085289061491, -0.017290253165383924, 0.019325977904460768, 0.005204442937554993,
    1.3076391847404059, 0.0, 0.017364109189745843, -0.018544456454265796, 14.811522032867726, 9.38317630848247,
    -5.2284261999445425, -48.95128052584765, 38.297096034337926, -10.58738133697598, 2.4332304376226275,
    -1.0453406042575444, 0.0717732095086726, 0.0021622109708082783, 0.007009595759602514, 0.0,
)
_B = (
    0.012127868517185414, 0.0, 0.0, 0.0, 0.0, 0.0, 0.08629746251568875, 0.2525469581187147, -0.1974186799326823,
    0.2031869190789726, -0.020775808077714918, 0.10967804874502014, 0.038065132526466504, 0.01163406880432423,
    0.0046580297040248785, 0.0, 0.0,
)
_B_VELOCITY = (
    0.012127868517185414, 0.0, 0.0, 0.0, 0.0, 0.0, 0.09083943422704079, 0.3156836976483934, -0.2632249065769097,
    0.3047803786184589, -0.041551616155429835, 0.2467756096762953, 0.15226053010586602, 0.08143848163026961,
    0.08502571193890811, -0.009155189630077963, 0.025,
)
_E = (
    -0.004880833389821577, 0.0, 0.0, 0.0, 0.0, 0.0, 0.014038126584857338, -0.11947921920803832, 0.20440246507662121,
    -0.1322681492223791, 0.11053069299761689, -0.07975385787102851, 0.011224330486437457, -0.004671596801593694,
    0.0008580413473282841, 0.0, 0.0,
)
_E_VELOCITY = (
    -0.004880833389821577, 0.0, 0.0, 0.0, 0.0, 0.0, 0.014776975352481408, -0.1493490240100479, 0.2725366201021616,
    -0.19840222383356862, 0.22106138599523378, -0.17944618020981415, 0.04489732194574983, -0.03270117761115586,
    0.015662325288859434, -0.029155189630077964, 0.025,
)
# fmt: on


def _tables() -> tuple[Array, Array]:
    """Weights of the accelerations in positions and velocities, shape (18, 17); the last row gives the solution."""
    position, velocity = np.zeros((N_STAGES + 1, N_STAGES)), np.zeros((N_STAGES + 1, N_STAGES))
    position[np.tril_indices(N_STAGES, -1)] = _A
    position[N_STAGES], velocity[N_STAGES] = _B, _B_VELOCITY
    for s in range(1, N_STAGES):
        # sum_j V_sj c_j^k = c_s^(k + 1)/(k + 1), of least norm
        before = NODE[:s]
        powers = np.arange(min(_MOMENTS, np.unique(before).size))
        exact = NODE[s] ** (powers + 1) / (powers + 1)
        velocity[s, :s] = np.linalg.lstsq(before ** powers[:, None], exact, rcond=None)[0]
    return position, velocity


NODE = np.array([*_NODES, 1.0])
POSITION, VELOCITY = _tables()
_E_POSITION, _E_SPEED = np.array(_E), np.array(_E_VELOCITY)
# Row s of the tables without zeros: the stages STAGE[FROM[s] : FROM[s + 1]] and their weights.
_USED = (POSITION != 0.0) | (VELOCITY != 0.0)
STAGE = np.concatenate([np.flatnonzero(row) for row in _USED])
IN_POSITION, IN_VELOCITY = POSITION[_USED], VELOCITY[_USED]
FROM = np.concatenate([[0], np.cumsum(_USED.sum(axis=1))])


@inlined
def stage_state(s: int, y: Array, h: float, k: Array, out: Array) -> None:
    """Write position and velocity ``out[6]`` of stage `s`; those at the end of the step for ``s = 17``.

    ``y[6]`` is the state at the beginning, ``k[s, 3:6]`` the accelerations of the stages before.
    """
    # Lanes: k[s, 2] without meaning, then the acceleration.
    x, v = spread(0.0), spread(0.0)
    for m in range(FROM[s], FROM[s + 1]):
        a = lanes_at(k, 6 * STAGE[m] + 2)
        x += a * IN_POSITION[m]
        v += a * IN_VELOCITY[m]
    ch = NODE[s] * h
    for j in range(3):
        out[j] = y[j] + (ch * y[3 + j] + h * (h * lane(x, j + 1)))
        out[3 + j] = y[3 + j] + h * lane(v, j + 1)


@inlined
def step_error(h: float, k: Array, length: float, speed: float) -> float:
    """Estimated error of a step: root mean square of its six components in units of `length` (m) and `speed` (m/s)."""
    x, v = spread(0.0), spread(0.0)
    for i in range(N_STAGES):
        a = lanes_at(k, 6 * i + 2)
        x += a * _E_POSITION[i]
        v += a * _E_SPEED[i]
    x *= h * h / length
    v *= h / speed
    squares = x * x + v * v
    return np.sqrt((lane(squares, 1) + lane(squares, 2) + lane(squares, 3)) / 6.0)
