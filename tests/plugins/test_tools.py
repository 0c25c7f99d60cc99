"""The tools of the product keep the contract of tools."""

from __future__ import annotations

from dataclasses import replace

import pytest

from contact_builtins.tools.axis import DrawAxis
from contact_builtins.tools.join import LinkPatches, PairPatches
from contact_builtins.tools.measure import Measure
from contact_builtins.tools.move import Move, Turn
from contact_builtins.tools.paint import CURVE, LASSO, Erase, Paint
from contact_builtins.tools.place import Place
from contact_builtins.tools.pose import DragJoint
from contact_builtins.tools.reshape import Bend, Scale, Weigh
from contact_builtins.tools.select import Select
from contact_builtins.tools.transfer import Transfer
from contact_core.interaction.tool import Tool
from contact_core.testing.tool_contract import ToolContract

PAINTS = {"comes_back": "what was passed over is painted"}


class TestSelect(ToolContract):
    cannot = {"edits": "it changes the selection alone"}

    @pytest.fixture
    def tool(self) -> Tool:
        return Select()


class TestPaint(ToolContract):
    cannot = PAINTS

    @pytest.fixture
    def tool(self) -> Tool:
        return Paint(radius=0.15, spacing=0.06)


class TestErase(ToolContract):
    cannot = PAINTS

    @pytest.fixture
    def tool(self) -> Tool:
        return Erase(radius=0.1)


class TestLasso(ToolContract):
    cannot = PAINTS

    @pytest.fixture
    def tool(self) -> Tool:
        return replace(LASSO, spacing=0.06)


class TestCurve(ToolContract):
    cannot = PAINTS

    @pytest.fixture
    def tool(self) -> Tool:
        return CURVE


class TestDrawAxis(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return DrawAxis()


class TestMove(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return Move()


class TestTurn(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return Turn()


class TestBend(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return Bend()


class TestScale(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return Scale()


class TestWeigh(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return Weigh()


class TestTransfer(ToolContract):
    cannot = {"comes_back": "a press alone already says where the copy goes"}

    @pytest.fixture
    def tool(self) -> Tool:
        return Transfer()


class TestLink(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return LinkPatches()


class TestPair(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return PairPatches()


class TestPlace(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return Place()


class TestDragJoint(ToolContract):
    @pytest.fixture
    def tool(self) -> Tool:
        return DragJoint()


class TestMeasure(ToolContract):
    cannot = {"edits": "it only measures"}

    @pytest.fixture
    def tool(self) -> Tool:
        return Measure()
