"""A pose solver of one's own, swapped in by one argument: SciPy's L-BFGS-B beside the default solver."""

import sys

import numpy as np
from scipy.optimize import minimize

import contact_core as contact
from contact_core.progress import NO_PROGRESS
from contact_core.solve.solver import Run


class Lbfgs:
    name = "scipy-lbfgs"
    summary = "L-BFGS-B of SciPy, from the pose as it is"

    def solve(self, problem, options=None, progress=NO_PROGRESS):
        run = Run(self.name, problem, options or contact.SolveOptions(), progress)

        def objective(scaled):
            state, value = run.evaluate(scaled * problem.scale)
            return value, problem.gradient(state) * problem.scale

        bounds = list(zip(*(limit / problem.scale for limit in problem.limits_of_theta), strict=True))
        minimize(objective, problem.start / problem.scale, jac=True, method="L-BFGS-B", bounds=bounds)
        return run.solution(contact.SolveStatus.CONVERGED)  # the best pose that was ever evaluated


@contact.hookimpl
def contact_pose_solvers():
    return [Lbfgs]


if __name__ == "__main__":
    plugins = contact.PluginManager([sys.modules[__name__]])
    with contact.new(hand="sample:human_hand", ball="sample:baseball", plugins=plugins) as session:
        rig, ball = session.rigs["hand"], session.geometry.mesh("ball")
        size = np.ptp(ball.points, axis=0).max()
        for side, name in ((-1.0, "thumb_distal"), (1.0, "index_distal")):
            tip = rig.rest_world[rig.joint_index(name), :3, 3]
            session.patches.brush("disk", name, surface="hand", at=tip, radius=0.05 * size)
            root = contact.SurfacePoints.at_vertices(ball, [int(np.argmax(side * ball.points[:, 0]))])
            session.pairs.add(name, session.patches.transfer(name, "ball", root, direction=[0.0, 1.0, 0.0]))
        for solver in ("levenberg-marquardt", "scipy-lbfgs"):
            proposal = session.solve(solver=solver, terms=["penetration"])
            found = proposal.after
            print(f"{found.solver}: objective {found.value:.4f} after {found.evaluations} evaluations")
        session.accept(proposal)
        session.draw("own_solver.png", camera_from=(0.5, 0.4, 1.0))
