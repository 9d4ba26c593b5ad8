"""Writes the small mesh files that crates/mesh-files/tests reads: one strip of two quads and two triangles, by VTK
itself, in every coding. Made with vtk 9.7.2 and numpy 2.4.6.

    python3 tests-python/write_meshes.py crates/mesh-files/testdata
"""

import sys
from pathlib import Path

import vtk

POINTS = [(0, 0, 0.125), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (3, 0.5, 0.1)]
CELLS = [(vtk.VTK_QUAD, (0, 1, 4, 3)), (vtk.VTK_QUAD, (1, 2, 5, 4)), (vtk.VTK_TRIANGLE, (2, 6, 5))]


def grid():
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for point in POINTS:
        points.InsertNextPoint(point)
    made = vtk.vtkUnstructuredGrid()
    made.SetPoints(points)
    for kind, nodes in CELLS:
        made.InsertNextCell(kind, len(nodes), nodes)
    return made


def write(folder: Path):
    for mode in ("ascii", "binary", "appended-base64", "appended-raw"):
        for compressed in (False, True):
            for bits in (32, 64):
                if mode == "ascii" and (compressed or bits == 64):
                    continue
                writer = vtk.vtkXMLUnstructuredGridWriter()
                writer.SetInputData(grid())
                name = f"{mode}{'-zlib' if compressed else ''}-{bits}.vtu"
                writer.SetFileName(str(folder / name))
                if mode == "ascii":
                    writer.SetDataModeToAscii()
                elif mode == "binary":
                    writer.SetDataModeToBinary()
                else:
                    writer.SetDataModeToAppended()
                    writer.SetEncodeAppendedData(mode == "appended-base64")
                if compressed:
                    writer.SetCompressorTypeToZLib()
                else:
                    writer.SetCompressorTypeToNone()
                writer.SetHeaderTypeToUInt64() if bits == 64 else writer.SetHeaderTypeToUInt32()
                writer.Write()
    surface = vtk.vtkGeometryFilter()
    surface.SetInputData(grid())
    surface.Update()
    polygons = vtk.vtkXMLPolyDataWriter()
    polygons.SetInputData(surface.GetOutput())
    polygons.SetFileName(str(folder / "polygons.vtp"))
    polygons.Write()
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(surface.GetOutput())
    triangles.Update()
    for kind, ending in ((vtk.vtkPLYWriter, "ply"), (vtk.vtkSTLWriter, "stl")):
        for binary in (False, True):
            writer = kind()
            writer.SetInputData(triangles.GetOutput())
            writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
            writer.SetFileName(str(folder / f"{'binary' if binary else 'ascii'}.{ending}"))
            writer.Write()


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    write(target)
