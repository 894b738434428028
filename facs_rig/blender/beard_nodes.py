"""The geometry nodes by which a beard goes with its face: `Bound.points`, as nodes."""

from __future__ import annotations

import bpy

MODIFIER, GROUP, FACE = "Follow Face", "Beard Follows Face", "Face"
SKULL = "skull"  # property of the beard's mesh and of the nodes: three vertices of the face
_TYPES = {"FLOAT_VECTOR": "VECTOR", "INT": "INT"}


def following(beard: bpy.types.Object, face: bpy.types.Object) -> None:
    """Let a beard follow a face by a modifier, the first of its own.

    The face is an input of the modifier: whoever duplicates both has a copy that follows the copy.
    """
    modifier = beard.modifiers.get(MODIFIER) or beard.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = _group_for([int(k) for k in beard.data[SKULL]])
    name = _face_input(modifier.node_group)
    if hasattr(modifier, "properties"):  # from 5.2 on
        getattr(modifier.properties.inputs, name).value = face
    else:
        modifier[name] = face


def followed(beard: bpy.types.Object) -> bpy.types.Object | None:
    """The face that a beard follows; None if it was deleted, or the beard's modifier was."""
    modifier = beard.modifiers.get(MODIFIER)
    if modifier is None or modifier.type != "NODES" or modifier.node_group is None:
        return None
    name = _face_input(modifier.node_group)
    if hasattr(modifier, "properties"):
        return getattr(getattr(modifier.properties.inputs, name, None), "value", None)
    return modifier.get(name) if name else None


def _group_for(skull: list[int]) -> bpy.types.NodeTree:
    """The nodes for faces with these vertices of the skull: one group for all of them."""
    for tree in bpy.data.node_groups:
        if tree.library is None and list(tree.get(SKULL, ())) == skull and _face_input(tree):
            return tree
    return _Group(skull).tree


def _face_input(tree: bpy.types.NodeTree) -> str:
    """The identifier of the group's input that is a face; empty if it has none."""
    if hasattr(tree, "interface"):
        found = (item for item in tree.interface.items_tree if item.item_type == "SOCKET")
        inputs = [item for item in found if item.in_out == "INPUT"]
    else:
        inputs = list(tree.inputs)
    return next((item.identifier for item in inputs if item.name == FACE), "")


class _Group:
    """Builds the nodes, from left to right."""

    def __init__(self, skull: list[int]) -> None:
        self.tree = tree = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
        tree[SKULL] = skull
        _sockets(tree)
        self._column = 0
        begin, end = self._node("NodeGroupInput"), self._node("NodeGroupOutput")
        info = self._node("GeometryNodeObjectInfo")
        info.transform_space = "RELATIVE"
        tree.links.new(begin.outputs[FACE], info.inputs["Object"])
        self._surface = info.outputs["Geometry"]
        self._place = self._node("GeometryNodeInputPosition").outputs[0]

        weight = self._split(self._named("root_weight", "FLOAT_VECTOR"))
        corners = [self._vertex(self._named(f"root_{k}", "INT")) for k in range(3)]
        at = self._sum([self._math("SCALE", corner, scale=share)
                        for corner, share in zip(corners, weight, strict=True)])  # fmt: skip
        around = [self._vertex(self._named(f"by_{k}", "INT")) for k in range(3)]
        skull_at = [self._vertex(self._whole(k)) for k in skull]
        turned = self._along(self._named("turned", "FLOAT_VECTOR"), around)
        stiff = self._along(self._named("stiff", "FLOAT_VECTOR"), skull_at)
        rest = self._named("rest", "FLOAT_VECTOR")
        moved = self._math("SUBTRACT", self._sum([at, turned, stiff]), rest)

        place = self._node("GeometryNodeSetPosition")
        tree.links.new(begin.outputs[0], place.inputs["Geometry"])
        tree.links.new(moved, place.inputs["Offset"])
        tree.links.new(place.outputs[0], end.inputs[0])
        begin.location, end.location = (-200, 0), (200 * self._column + 200, 0)

    def _node(self, kind: str) -> bpy.types.Node:
        node = self.tree.nodes.new(kind)
        node.location = (180 * (self._column // 4), -220 * (self._column % 4))
        node.hide = False
        self._column += 1
        return node

    def _named(self, name: str, kind: str) -> bpy.types.NodeSocket:
        """An attribute of the beard's vertices."""
        node = self._node("GeometryNodeInputNamedAttribute")
        node.data_type = kind
        node.inputs["Name"].default_value = name
        return next(s for s in node.outputs if s.name == "Attribute" and s.type == _TYPES[kind])

    def _whole(self, number: int) -> bpy.types.NodeSocket:
        node = self._node("FunctionNodeInputInt")
        node.integer = number
        return node.outputs[0]

    def _vertex(self, index: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Where the face's vertex of a number is."""
        node = self._node("GeometryNodeSampleIndex")
        node.data_type, node.domain = "FLOAT_VECTOR", "POINT"
        self.tree.links.new(self._surface, node.inputs["Geometry"])
        value = next(s for s in node.inputs if s.name == "Value" and s.type == "VECTOR")
        self.tree.links.new(self._place, value)
        self.tree.links.new(index, node.inputs["Index"])
        return next(s for s in node.outputs if s.type == "VECTOR")

    def _math(
        self, how: str, *given: bpy.types.NodeSocket, scale: bpy.types.NodeSocket | None = None
    ) -> bpy.types.NodeSocket:
        node = self._node("ShaderNodeVectorMath")
        node.operation = how
        for k, socket in enumerate(given):
            self.tree.links.new(socket, node.inputs[k])
        if scale is not None:
            self.tree.links.new(scale, node.inputs["Scale"])
        return node.outputs["Vector"]

    def _sum(self, given: list[bpy.types.NodeSocket]) -> bpy.types.NodeSocket:
        total = given[0]
        for socket in given[1:]:
            total = self._math("ADD", total, socket)
        return total

    def _split(self, vector: bpy.types.NodeSocket) -> list[bpy.types.NodeSocket]:
        node = self._node("ShaderNodeSeparateXYZ")
        self.tree.links.new(vector, node.inputs[0])
        return list(node.outputs[:3])

    def _along(
        self, way: bpy.types.NodeSocket, corners: list[bpy.types.NodeSocket]
    ) -> bpy.types.NodeSocket:
        """A way in the right-angled axes of a triangle: see `follow.axes_of`."""
        along = self._math("SUBTRACT", corners[1], corners[0])
        other = self._math("SUBTRACT", corners[2], corners[0])
        out = self._math("NORMALIZE", self._math("CROSS_PRODUCT", along, other))
        along = self._math("NORMALIZE", along)
        across = self._math("CROSS_PRODUCT", out, along)
        parts = zip((along, across, out), self._split(way), strict=True)
        return self._sum([self._math("SCALE", axis, scale=share) for axis, share in parts])


def _sockets(tree: bpy.types.NodeTree) -> None:
    """What goes into a group and comes out; from 4.0 on these are of its interface."""
    if hasattr(tree, "interface"):
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        tree.interface.new_socket(FACE, in_out="INPUT", socket_type="NodeSocketObject")
        return
    tree.inputs.new("NodeSocketGeometry", "Geometry")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    tree.inputs.new("NodeSocketObject", FACE)
