"""What contact-core brings itself, registered exactly as a studio's plugin would be.

Each line is a reference, imported when the slot is first asked for it: a missing optional library takes away
one object and shows in `contact plugins`. Add yours as one line.
"""

from __future__ import annotations

from contact_core.plugins import hookimpl


@hookimpl
def contact_brushes() -> list[object]:
    return [
        "contact_builtins.brushes.disk:DiskBrush",
        "contact_builtins.brushes.disk:Eraser",
        "contact_builtins.brushes.vertices:VertexBrush",
        "contact_builtins.brushes.vertices:SelectionBrush",
        "contact_builtins.brushes.curve:CurveBrush",
        "contact_builtins.brushes.lasso:LassoBrush",
    ]


@hookimpl
def contact_axis_generators() -> list[object]:
    return [
        "contact_builtins.axes.guided:Guided",
        "contact_builtins.axes.consistent:Consistent",
        "contact_builtins.axes.along_bone:AlongBone",
        "contact_builtins.axes.principal:Principal",
        "contact_builtins.axes.medial_axis:MedialAxis",
        "contact_builtins.axes.farthest_pair:FarthestPair",
    ]


@hookimpl
def contact_placers() -> list[object]:
    return [
        "contact_builtins.placers.from_pose:FromPose",
        "contact_builtins.placers.naive:Naive",
    ]


@hookimpl
def contact_grasp_samplers() -> list[object]:
    return ["contact_builtins.grasps.around:Around"]


@hookimpl
def contact_grasp_scores() -> list[object]:
    return ["contact_builtins.grasps.balanced:Balanced"]


@hookimpl
def contact_pose_solvers() -> list[object]:
    return [
        "contact_core.solve.levenberg_marquardt:LevenbergMarquardt",
        "contact_builtins.solvers.nlopt_solver:NLoptSolver",
        "contact_builtins.solvers.stepwise:StagedSolver",
        "contact_builtins.solvers.stepwise:ProgressiveSolver",
        "contact_builtins.solvers.stepwise:MultiStartSolver",
    ]


@hookimpl
def contact_pose_terms() -> list[object]:
    return [
        "contact_core.solve.terms:DistanceTerm",
        "contact_core.solve.terms:NormalTerm",
        "contact_core.solve.terms:PriorTerm",
        "contact_core.solve.penetration:PenetrationTerm",
        "contact_builtins.terms.self_collision:SelfCollisionTerm",
        "contact_builtins.terms.aims:PinTerm",
        "contact_builtins.terms.aims:LookTerm",
        "contact_builtins.terms.balance:BalanceTerm",
    ]


@hookimpl
def contact_geodesic_engines() -> list[object]:
    return [
        "contact_core.geometry.engine:ExactEngine",
        "contact_builtins.engines.vector_heat:VectorHeatEngine",
    ]


@hookimpl
def contact_hosts() -> list[object]:
    return ["contact_core.scene.memory_host:MemoryHost"]


@hookimpl
def contact_tools() -> list[object]:
    return [
        "contact_builtins.tools.select:Select",
        "contact_builtins.tools.paint:Paint",
        "contact_builtins.tools.paint:Erase",
        "contact_builtins.tools.paint:LASSO",
        "contact_builtins.tools.paint:CURVE",
        "contact_builtins.tools.axis:DrawAxis",
        "contact_builtins.tools.move:Move",
        "contact_builtins.tools.move:Turn",
        "contact_builtins.tools.reshape:Bend",
        "contact_builtins.tools.reshape:Scale",
        "contact_builtins.tools.transfer:Transfer",
        "contact_builtins.tools.join:LinkPatches",
        "contact_builtins.tools.join:PairPatches",
        "contact_builtins.tools.reshape:Weigh",
        "contact_builtins.tools.place:Place",
        "contact_builtins.tools.pose:DragJoint",
        "contact_builtins.tools.measure:Measure",
    ]


@hookimpl
def contact_formats() -> list[object]:
    return [
        "contact_builtins.formats.gltf:GltfFiles",
        "contact_builtins.formats.mesh_files:MeshFiles",
        "contact_builtins.formats.scene_meshes:SceneMeshFiles",
        "contact_builtins.formats.urdf:UrdfFiles",
    ]


@hookimpl
def contact_renderers() -> list[object]:
    return ["contact_builtins.renderers.software:SoftwareRenderer"]


@hookimpl
def contact_samples() -> list[object]:
    return [
        "contact_builtins.samples.catalogue:HUMAN_HAND",
        "contact_builtins.samples.catalogue:WITCH_HAND",
        "contact_builtins.samples.catalogue:ALIEN_HAND",
        "contact_builtins.samples.catalogue:TENTACLE",
        "contact_builtins.samples.catalogue:HUMAN_BODY",
        "contact_builtins.samples.catalogue:MUG",
        "contact_builtins.samples.catalogue:BASEBALL",
        "contact_builtins.samples.catalogue:SCISSORS",
        "contact_builtins.samples.catalogue:RABBIT",
        "contact_builtins.samples.catalogue:POLE",
        "contact_builtins.samples.catalogue:CHAIR",
        "contact_builtins.samples.catalogue:FLOOR",
    ]


@hookimpl
def contact_proxy_makers() -> list[object]:
    return ["contact_builtins.proxies.level_set:LevelSetProxy"]


@hookimpl
def contact_cli() -> list[object]:
    return [
        "contact_builtins.cli.inspect:Inspect",
        "contact_builtins.cli.repair:Repair",
        "contact_builtins.cli.demo:Demo",
        "contact_gallery.command:GalleryCommand",
        "contact_gallery.survey.command:SurveyCommand",
    ]
