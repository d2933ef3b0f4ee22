"""Check of an exported folder by 3D Slicer: its own libraries open the scene, list its nodes, and draw it.

    python scripts/pictures/slicer_scene.py FOLDER/scene.mrml [--picture FILE.png] [--save FOLDER]

Prints a JSON object with the positions of every node as read by Slicer, in its own frame (RAS) and mm; `--save` writes
its markups and transforms to files as Slicer does. Needs slicer-core, which is part of the test tools on platforms for
which it is published. Run it in a separate process, since Slicer's libraries modify VTK.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import slicer
import vtk

SIZE = (1440, 900)
_LOGICS = {
    "Markups": slicer.vtkSlicerMarkupsLogic,
    "Models": slicer.vtkSlicerModelsLogic,
    "Volumes": slicer.vtkSlicerVolumesLogic,
    "Transforms": slicer.vtkSlicerTransformLogic,
}
_WIDGETS = {
    slicer.vtkMRMLMarkupsCurveNode: slicer.vtkSlicerCurveWidget,
    slicer.vtkMRMLMarkupsFiducialNode: slicer.vtkSlicerPointsWidget,
    slicer.vtkMRMLMarkupsLineNode: slicer.vtkSlicerLineWidget,
    slicer.vtkMRMLMarkupsPlaneNode: slicer.vtkSlicerPlaneWidget,
    slicer.vtkMRMLMarkupsROINode: slicer.vtkSlicerROIWidget,
}
_MANAGERS = ("vtkMRMLModelDisplayableManager", "vtkMRMLMarkupsDisplayableManager")


class SlicerScene:
    """A scene read by the libraries of 3D Slicer. Raises ValueError if Slicer reports an error."""

    def __init__(self, file: Path) -> None:
        self._errors: list[str] = []

        def failed(caller: Any, event: str, message: str) -> None:
            self._errors.append(message.strip())

        vtk.vtkOutputWindow.GetInstance().AddObserver("ErrorEvent", vtk.calldata_type(vtk.VTK_STRING)(failed))
        self.scene = slicer.vtkMRMLScene()
        self._application = slicer.vtkSlicerApplicationLogic()
        self._application.SetMRMLScene(self.scene)
        self._logics = [self._logic(name, kind) for name, kind in _LOGICS.items()]
        self.scene.SetURL(str(file))
        read = self.scene.Connect()
        if not read or self._errors:
            raise ValueError(f"3D Slicer does not open {file}: {' '.join(self._errors) or 'no reason told'}")

    def _logic(self, name: str, kind: Any) -> Any:
        logic = kind()
        logic.SetMRMLApplicationLogic(self._application)
        logic.SetMRMLScene(self.scene)
        self._application.SetModuleLogic(name, logic)
        if name == "Markups":
            for node, widget in _WIDGETS.items():
                if not logic.IsMarkupsNodeRegistered(node().GetClassName()):
                    logic.RegisterMarkupsNode(node(), widget())
        return logic

    def nodes(self) -> dict[str, dict[str, Any]]:
        """Return every markup, surface, volume and transform by its name."""
        found = {}
        for number in range(self.scene.GetNumberOfNodes()):
            node = self.scene.GetNthNode(number)
            for kind, told in _TOLD.items():
                if node.IsA(kind):
                    own = {"class": node.GetClassName(), "description": node.GetDescription() or ""}
                    found[node.GetName()] = {**own, **told(node)}
        return found

    def save(self, folder: Path) -> None:
        """Write every markup and transform as Slicer does, under the names of the files that were read."""
        folder.mkdir(parents=True, exist_ok=True)
        for number in range(self.scene.GetNumberOfNodes()):
            node = self.scene.GetNthNode(number)
            if node.IsA("vtkMRMLMarkupsNode") or node.IsA("vtkMRMLLinearTransformNode"):
                storage = node.GetStorageNode()
                file = folder / Path(storage.GetFileName()).name
                storage.SetFileName(str(file))
                if not storage.WriteData(node) or self._errors:
                    raise ValueError(f"3D Slicer does not write {file}: {' '.join(self._errors)}")

    def draw(self, file: Path) -> None:
        """Draw the three-dimensional view to a PNG file."""
        factory = slicer.vtkMRMLThreeDViewDisplayableManagerFactory.GetInstance()
        factory.SetMRMLApplicationLogic(self._application)
        for name in _MANAGERS:
            factory.RegisterDisplayableManager(name)
        view = slicer.vtkMRMLViewNode()
        view.SetLayoutName("1")
        self.scene.AddNode(view)
        renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
        renderer.SetBackground(*view.GetBackgroundColor())  # without Slicer's gradient, which takes many colours
        window.SetOffScreenRendering(1)
        window.SetMultiSamples(8)
        window.SetSize(*SIZE)
        window.AddRenderer(renderer)
        interactor = vtk.vtkGenericRenderWindowInteractor()
        interactor.SetRenderWindow(window)
        managers = factory.InstantiateDisplayableManagers(renderer)
        managers.SetMRMLDisplayableNode(view)
        _look_from(renderer, (-0.75, 1.0, 0.35))
        for _ in range(2):  # labels are positioned after the first rendering
            window.Render()
        picture, writer = vtk.vtkWindowToImageFilter(), vtk.vtkPNGWriter()
        picture.SetInput(window)
        picture.ReadFrontBufferOff()
        writer.SetInputConnection(picture.GetOutputPort())
        writer.SetFileName(str(file))
        writer.Write()


def _look_from(renderer: Any, direction: tuple[float, float, float]) -> None:
    """Show everything from a direction in Slicer's frame (RAS), with the head upright."""
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0.0, 0.0, 0.0)
    camera.SetPosition(*direction)
    camera.SetViewUp(0.0, 0.0, 1.0)
    renderer.ResetCamera()
    camera.Zoom(1.5)


def _rows(matrix: Any) -> list[list[float]]:
    return [[matrix.GetElement(row, column) for column in range(4)] for row in range(4)]


def _markup(node: Any) -> dict[str, Any]:
    count = node.GetNumberOfControlPoints()
    told: dict[str, Any] = {
        "labels": [node.GetNthControlPointLabel(number) for number in range(count)],
        "places": [list(node.GetNthControlPointPositionWorld(number)) for number in range(count)],
        "visible": bool(node.GetDisplayNode().GetVisibility()),
    }
    if node.IsA("vtkMRMLMarkupsPlaneNode"):
        told |= {"normal": list(node.GetNormalWorld()), "origin": list(node.GetOriginWorld())}
    if node.IsA("vtkMRMLMarkupsROINode"):
        size = [0.0, 0.0, 0.0]
        node.GetSizeWorld(size)
        told |= {"size": size, "axes": _rows(node.GetObjectToWorldMatrix())}
    return told


def _model(node: Any) -> dict[str, Any]:
    mesh = node.GetPolyData()
    return {
        "points": [list(mesh.GetPoint(number)) for number in range(min(mesh.GetNumberOfPoints(), 100))],
        "triangles": mesh.GetNumberOfPolys(),
        "bounds": list(mesh.GetBounds()),
    }


def _volume(node: Any) -> dict[str, Any]:
    to_ras = vtk.vtkMatrix4x4()
    node.GetIJKToRASMatrix(to_ras)
    size = list(node.GetImageData().GetDimensions())
    corner = [node.GetImageData().GetScalarComponentAsDouble(*index, 0) for index in ((0, 0, 0), (1, 2, 3))]
    return {"ijk_to_ras": _rows(to_ras), "size": size, "hu": corner}


def _transform(node: Any) -> dict[str, Any]:
    to_world = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToWorld(to_world)
    return {"to_world": _rows(to_world)}


_TOLD = {
    "vtkMRMLMarkupsNode": _markup,
    "vtkMRMLModelNode": _model,
    "vtkMRMLScalarVolumeNode": _volume,
    "vtkMRMLLinearTransformNode": _transform,
}


def main() -> int:
    """Open the scene, print its nodes, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--picture", type=Path, help="draw the scene to this PNG file")
    parser.add_argument("--save", type=Path, help="write markups and transforms to this folder")
    wanted = parser.parse_args()
    opened = SlicerScene(wanted.scene)
    if wanted.picture:
        opened.draw(wanted.picture)
    if wanted.save:
        opened.save(wanted.save)
    print(json.dumps(opened.nodes()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
