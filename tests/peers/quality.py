"""Compares `octetra quality` with VTK's vtkMeshQuality, tet by tet, and times both.

    python tests/peers/quality.py target/release/octetra MESH.vtu ...      needs vtk and numpy from PyPI

Prints for each metric the largest relative difference over all tets: of the values by definition, of those of --as-vtk, and the seconds of
octetra, of VTK as its wheel comes (sequential), and of VTK with threads. Differences are relative to the value, or to a hundredth of the
metric's median where a value is smaller than that (a skew or squish near 0 is a difference of numbers near 1). Exit status 1 if a metric
differs by more than 1e-6 from VTK under --as-vtk, or by definition where VTK is not known to be wrong.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

NAMES = {  # octetra's: VTK's
    "scaled_jacobian": "ScaledJacobian", "shape": "Shape", "aspect_ratio": "AspectRatio", "radius_ratio": "RadiusRatio",
    "edge_ratio": "EdgeRatio", "aspect_gamma": "AspectGamma", "aspect_frobenius": "AspectFrobenius", "condition": "Condition",
    "mean_ratio": "MeanRatio", "collapse_ratio": "CollapseRatio", "min_angle": "MinAngle", "equiangle_skew": "EquiangleSkew",
    "equivolume_skew": "EquivolumeSkew", "squish_index": "SquishIndex", "normalized_inradius": "NormalizedInradius",
    "relative_size_squared": "RelativeSizeSquared", "shape_and_size": "ShapeAndSize", "distortion": "Distortion",
    "inradius": "Inradius", "jacobian": "Jacobian", "volume": "Volume",
}
WRONG_IN_VTK = {"min_angle", "collapse_ratio"}
RUNS = 5


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def octetra(program, mesh, folder, *flags):
    """Arrays by metric, and seconds."""
    seconds = {}
    for _ in range(RUNS):
        subprocess.run([program, "quality", mesh, "--metric", "all", "--json", folder / "q.json", *flags], check=True, stdout=subprocess.DEVNULL)
        for metric in json.loads((folder / "q.json").read_text())["metrics"]:
            seconds[metric["name"]] = min(metric["seconds"], seconds.get(metric["name"], np.inf))
    out = folder / "q.vtu"
    subprocess.run([program, "quality", mesh, "--metric", "all", "--array-out", out, *flags], check=True, stdout=subprocess.DEVNULL)
    grid = read(out)
    arrays = {name: vtk_to_numpy(grid.GetCellData().GetArray("quality:" + name)).copy() for name in NAMES}
    return grid, arrays, seconds


def of_vtk(grid, name):
    """Values of a metric, and seconds without and with threads."""
    seconds = {}
    for backend in ("Sequential", "STDThread"):
        vtk.vtkSMPTools.SetBackend(backend)
        seconds[backend] = np.inf
        for _ in range(RUNS):
            quality = vtk.vtkMeshQuality()
            quality.SetInputData(grid)
            getattr(quality, "SetTetQualityMeasureTo" + NAMES[name])()
            start = time.perf_counter()
            quality.Update()
            seconds[backend] = min(seconds[backend], time.perf_counter() - start)
    return vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality")).copy(), seconds


def difference(a, b):
    """The largest relative difference; 1e30 is VTK's infinity."""
    b = np.where(np.abs(b) >= 1e30, np.inf, b)
    both = np.isfinite(a) & np.isfinite(b)
    floor = 0.01 * np.median(np.abs(b[both])) if both.any() else 1.0
    relative = np.abs(a - b)[both] / np.maximum(np.maximum(np.abs(b[both]), floor), 1e-300)
    return (relative.max() if both.any() else 0.0), int((np.isfinite(a) != np.isfinite(b)).sum())


def main():
    program, meshes = sys.argv[1], sys.argv[2:]
    print("VTK", vtk.vtkVersion().GetVTKVersion(), "threads", vtk.vtkMultiThreader.GetGlobalDefaultNumberOfThreads())
    failed = False
    for mesh in meshes:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            _, asked, _ = octetra(program, mesh, folder, "--as-vtk")
            grid, defined, seconds = octetra(program, mesh, folder)
            bare = vtk.vtkUnstructuredGrid()
            bare.CopyStructure(grid)  # without arrays, which VTK would copy
            print(f"\n{mesh}: {bare.GetNumberOfCells()} tets")
            print(f"{'metric':<22} {'by definition':>14} {'--as-vtk':>10} {'apart':>6} {'octetra ms':>11} {'VTK ms':>9} {'ratio':>6} {'threads':>9} {'ratio':>6}")
            for name in NAMES:
                values, times = of_vtk(bare, name)
                (by_definition, _), (as_vtk, apart) = difference(defined[name], values), difference(asked[name], values)
                failed |= as_vtk > 1e-6 or (by_definition > 1e-6 and name not in WRONG_IN_VTK)
                ours, one, many = 1e3 * seconds[name], 1e3 * times["Sequential"], 1e3 * times["STDThread"]
                print(f"{name:<22} {by_definition:>14.1e} {as_vtk:>10.1e} {apart:>6} {ours:>11.2f} {one:>9.1f} {one / ours:>6.1f} {many:>9.1f} {many / ours:>6.1f}", flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
