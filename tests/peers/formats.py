"""Opens every file of the shared data with VTK, meshio and octetra, and writes a table of what each finds.

    python -m venv venv && venv/bin/pip install vtk meshio h5py netCDF4
    OCTETRA_SHARED=../shared venv/bin/python tests/peers/formats.py --octetra target/release/octetra -o formats.md

The files are those of data/tet, data/interop and data/surface, or the ones named. Points, cells by type and the range of every component of
every array are compared; ranges are the same if they differ by less than 1e-6 of their size (readers differ in f32 and f64). Each reader
runs in a process of its own (by fork: Linux and macOS), since some crash. The exit status is 1 if VTK or meshio opens a file that octetra
does not, or if VTK (where it refuses, meshio) finds other points or cells.
"""

import argparse
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

import meshio
import numpy as np
import vtk
from meshio._vtk_common import meshio_to_vtk_type

SECONDS = 120
TOLERANCE = 1e-6
SKIPPED = {".py", ".txt", ".md", ".h5", ".geo", ".ele"}  # the last three belong to files that name them or lie beside them
# octetra's names of VTK's types.
TYPES = {
    0: "empty cell", 1: "vertex", 2: "poly-vertex", 3: "line", 4: "poly-line", 5: "triangle", 6: "triangle strip", 7: "polygon", 8: "pixel",
    9: "quad", 10: "tetrahedron", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid", 15: "pentagonal prism", 16: "hexagonal prism",
    21: "quadratic edge", 22: "quadratic triangle", 23: "quadratic quad", 24: "quadratic tetrahedron", 25: "quadratic hexahedron",
    26: "quadratic wedge", 27: "quadratic pyramid", 28: "biquadratic quad", 29: "triquadratic hexahedron", 30: "quadratic-linear quad",
    31: "quadratic-linear wedge", 32: "biquadratic-quadratic wedge", 33: "biquadratic-quadratic hexahedron", 34: "biquadratic triangle",
    35: "cubic line", 36: "quadratic polygon", 37: "triquadratic pyramid", 41: "convex point set", 42: "polyhedron", 68: "Lagrange curve",
    69: "Lagrange triangle", 70: "Lagrange quadrilateral", 71: "Lagrange tetrahedron", 72: "Lagrange hexahedron", 73: "Lagrange wedge",
    74: "Lagrange pyramid", 75: "Bezier curve", 76: "Bezier triangle", 77: "Bezier quadrilateral", 78: "Bezier tetrahedron",
    79: "Bezier hexahedron", 80: "Bezier wedge", 81: "Bezier pyramid",
}  # fmt: skip
VTK_READERS = {
    ".vtu": "vtkXMLUnstructuredGridReader", ".pvtu": "vtkXMLPUnstructuredGridReader", ".vti": "vtkXMLImageDataReader",
    ".vtr": "vtkXMLRectilinearGridReader", ".pvtr": "vtkXMLPRectilinearGridReader", ".vts": "vtkXMLStructuredGridReader",
    ".vtp": "vtkXMLPolyDataReader", ".pvtp": "vtkXMLPPolyDataReader", ".vtk": "vtkGenericDataObjectReader", ".e": "vtkExodusIIReader",
    ".ex2": "vtkExodusIIReader", ".exo": "vtkExodusIIReader", ".foam": "vtkOpenFOAMReader", ".case": "vtkGenericEnSightReader",
    ".obj": "vtkOBJReader", ".stl": "vtkSTLReader", ".ply": "vtkPLYReader", ".msh": "vtkGmshReader", ".xdmf": "vtkXdmf3Reader",
    ".vtkhdf": "vtkHDFReader", ".hdf": "vtkHDFReader",
}  # fmt: skip


class Refused(Exception):
    pass


def by_vtk(path, _):
    name = VTK_READERS.get(path.suffix.lower())
    if name is None or not hasattr(vtk, name):
        raise Refused("no reader")
    reader, errors = getattr(vtk, name)(), []

    def remember(_, __, text):
        errors.append(text)

    remember.CallDataType = "string0"
    reader.AddObserver("ErrorEvent", remember)
    vtk.vtkObject.GlobalWarningDisplayOff()
    (reader.SetCaseFileName if name == "vtkGenericEnSightReader" else reader.SetFileName)(str(path))
    reader.UpdateInformation()
    is_exodus = name == "vtkExodusIIReader"
    if is_exodus:
        reader.SetSqueezePoints(False)  # every block has all points
        blocks = [reader.EDGE_BLOCK, reader.FACE_BLOCK, reader.ELEM_BLOCK]
        for kind in blocks:
            for i in range(reader.GetNumberOfObjects(kind)):
                reader.SetObjectStatus(kind, i, 1)
        for kind in [*blocks, reader.NODAL]:
            for i in range(reader.GetNumberOfObjectArrays(kind)):
                reader.SetObjectArrayStatus(kind, reader.GetObjectArrayName(kind, i), 1)
    if name == "vtkGenericEnSightReader":
        reader.ReadAllVariablesOn()
    if name == "vtkOpenFOAMReader":
        reader.CreateCellToPointOff()
        reader.DisableAllPatchArrays()
        reader.SetPatchArrayStatus("internalMesh", 1)
        times = reader.GetTimeValues()
        if times is not None and times.GetNumberOfTuples():
            reader.UpdateTimeStep(times.GetValue(times.GetNumberOfTuples() - 1))
    if name == "vtkGenericDataObjectReader":
        for all_of in ["Scalars", "Vectors", "Normals", "Tensors", "TCoords", "Fields"]:
            getattr(reader, f"ReadAll{all_of}On")()
    reader.Update()
    found = {"points": 0, "cells": {}, "arrays": {}}
    for part in leaves(reader.GetOutputDataObject(0)):
        points = part.GetNumberOfPoints()
        found["points"] = max(found["points"], points) if is_exodus else found["points"] + points
        for i in range(part.GetNumberOfCells()):
            kind = TYPES.get(part.GetCellType(i), str(part.GetCellType(i)))
            found["cells"][kind] = found["cells"].get(kind, 0) + 1
        for of, data in [("points", part.GetPointData()), ("cells", part.GetCellData())]:
            for array in (data.GetArray(i) for i in range(data.GetNumberOfArrays())):
                if array is None or array.GetNumberOfTuples() == 0:
                    continue
                components = range(array.GetNumberOfComponents())
                ranges = [finite(array.GetFiniteRange(k)) for k in components]
                add(found["arrays"], of, array.GetName(), ranges)
    if found["points"] == 0:
        raise Refused(errors[0] if errors else "reads no points")
    return found


def leaves(data):
    """The data sets in a data set."""
    if data is None:
        return
    if data.IsA("vtkCompositeDataSet"):
        each = data.NewIterator()
        each.InitTraversal()
        while not each.IsDoneWithTraversal():
            yield each.GetCurrentDataObject()
            each.GoToNextItem()
    elif data.IsA("vtkDataSet"):
        yield data


def add(arrays, of, name, ranges):
    """Adds an array of a part; of one known, widens the ranges."""
    key = f"{of}:{name}"
    known = arrays.get(key)
    if known is None or len(known) != len(ranges):
        arrays[key] = ranges
        return
    for k, two in enumerate(ranges):
        both = [r for r in (known[k], two) if r]
        known[k] = [min(r[0] for r in both), max(r[1] for r in both)] if both else None


def finite(pair):
    lo, hi = float(pair[0]), float(pair[1])
    return [lo, hi] if lo <= hi and math.isfinite(lo) and math.isfinite(hi) else None


def by_meshio(path, _):
    try:
        mesh = meshio.read(path)
    except SystemExit as error:
        raise Refused("ends the program") from error
    except Exception as error:
        raise Refused(f"{type(error).__name__}: {error}") from error
    found = {"points": len(mesh.points), "cells": {}, "arrays": {}}
    for block in mesh.cells:
        number = meshio_to_vtk_type.get(block.type, 42 if block.type.startswith("polyhedron") else block.type)
        name = TYPES.get(number, str(number))
        found["cells"][name] = found["cells"].get(name, 0) + len(block.data)
    for of, arrays in [("points", mesh.point_data), ("cells", mesh.cell_data)]:
        for name, values in arrays.items():
            for part in values if of == "cells" else [values]:
                part = np.asarray(part)
                if part.size == 0 or part.dtype.kind not in "iufb":
                    continue
                flat = part.reshape(len(part), -1).astype(float)
                flat[~np.isfinite(flat)] = np.nan
                all_nan = np.isnan(flat).all(axis=0)
                ranges = [None if all_nan[k] else [np.nanmin(flat[:, k]), np.nanmax(flat[:, k])] for k in range(flat.shape[1])]
                add(found["arrays"], of, name, ranges)
    return found


def by_octetra(path, program):
    info = [program, "info", str(path), "--json", "-"]
    result = subprocess.run(info, capture_output=True, text=True, timeout=SECONDS)
    if result.returncode == 0 and not result.stdout.lstrip().startswith("{"):
        steps = sum(line.startswith("step ") for line in result.stdout.splitlines())  # a series: its last step
        result = subprocess.run([*info, "--time-step", str(steps - 1)], capture_output=True, text=True, timeout=SECONDS)
    if result.returncode < 0 or result.returncode > 2 or "panicked" in result.stderr:
        raise Refused(f"CRASH ({result.returncode}) {result.stderr.strip()[-300:]}")
    if result.returncode != 0:
        raise Refused(result.stderr.strip())
    said = json.loads(result.stdout)
    found = {"points": said["points"], "cells": said.get("cells"), "arrays": {}, "notes": said.get("notes", [])}
    found["is_volume"] = "volume" in said
    for array in said["arrays"]:
        found["arrays"][f"{array['of']}:{array['name']}"] = array["range"]
    return found


def read(reader, path, program):
    """What a reader finds; it works in a copy of this process, which may crash."""
    with tempfile.TemporaryFile() as answer:
        child = os.fork()
        if child == 0:
            signal.alarm(SECONDS)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(1, 2)
            try:
                found = {"vtk": by_vtk, "meshio": by_meshio, "octetra": by_octetra}[reader](path, program)
            except Refused as error:
                found = {"refused": str(error)}
            except BaseException as error:
                found = {"refused": f"{type(error).__name__}: {error}"}
            answer.write(json.dumps(found).encode())
            answer.flush()
            os._exit(0)  # some libraries crash when they are unloaded
        _, status = os.waitpid(child, 0)
        number = os.waitstatus_to_exitcode(status)
        if number == -signal.SIGALRM:
            return {"refused": f"takes more than {SECONDS} s"}
        if number != 0:
            return {"refused": f"CRASH ({signal.Signals(-number).name if number < 0 else number})"}
        answer.seek(0)
        return json.loads(answer.read())


def short(text, path):
    text = "".join(c if c.isprintable() else " " for c in str(text).replace(str(path), "FILE"))
    text = " ".join(text.replace("|", "/").split())
    return text if len(text) <= 160 else text[:157] + "..."


def is_same(a, b):
    if a is None or b is None:
        return a is None and b is None
    size = max(abs(v) for v in [*a, *b])
    return all(abs(x - y) <= TOLERANCE * size for x, y in zip(a, b))


def differences(peer, ours):
    """(what is graver: points and cells, what is not: arrays) as text."""
    grave, light = [], []
    if peer["points"] != ours["points"]:
        grave.append(f"{peer['points']} points, not {ours['points']}")
    if not ours["is_volume"]:
        cells = [in_general(found["cells"]) for found in (peer, ours)]
        for kind in sorted({*cells[0], *cells[1]}):
            counts = [found.get(kind, 0) for found in cells]
            if counts[0] != counts[1]:
                grave.append(f"{kind}: {counts[0]}, not {counts[1]}")
    if ours["is_volume"]:  # one array of the file, as it was asked for
        arrays = {key: ranges for key, ranges in peer["arrays"].items() if key in ours["arrays"]}
        if peer["arrays"] and not arrays:
            light.append("other arrays")
    else:
        arrays = peer["arrays"]
    for key, ranges in arrays.items():
        own = ours["arrays"].get(key)
        if own is None:
            light.append(f"has {key.replace('points:', 'P:').replace('cells:', 'C:')}")
        elif len(own) != len(ranges):
            light.append(f"{key}: {len(ranges)} components, not {len(own)}" if not ours["is_volume"] else f"{key}: a vector, here its length")
        elif not all(is_same(a, b) for a, b in zip(ranges, own)):
            light.append(f"{key}: range {ranges}, not {own}")
    return grave, light


def in_general(cells):
    """Cells by type, where a voxel is a hexahedron and a pixel a quad."""
    merged = {}
    for kind, count in cells.items():
        kind = {"voxel": "hexahedron", "pixel": "quad"}.get(kind, kind)
        merged[kind] = merged.get(kind, 0) + count
    return merged


def cell_text(found):
    if found.get("is_volume"):
        return "volume"
    return ", ".join(f"{count} {kind}" for kind, count in found["cells"].items())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    parser.add_argument("--octetra", default="target/release/octetra")
    parser.add_argument("-o", "--output", type=pathlib.Path)
    args = parser.parse_args()
    data = pathlib.Path(os.environ.get("OCTETRA_SHARED", "../shared")) / "data"
    files = args.files
    if not files:
        inside_a_case = lambda path: any((folder / "case.foam").exists() for folder in path.parents) and path.suffix != ".foam"
        files = sorted(p for folder in ["tet", "interop", "surface"] for p in (data / folder).rglob("*") if p.is_file())
        files = [path for path in files if path.suffix not in SKIPPED and not inside_a_case(path)]
    rows, bad = [], 0
    counts = {"vtk": 0, "meshio": 0, "octetra": 0, "same": 0}
    for number, path in enumerate(files):
        print(f"{number + 1}/{len(files)} {path}", file=sys.stderr)
        found = {reader: read(reader, path, args.octetra) for reader in ["octetra", "vtk", "meshio"]}
        ours = found["octetra"]
        name = path.relative_to(data) if path.is_relative_to(data) else path
        row = [f"`{name}`"]
        if "refused" in ours:
            row.append(f"refused: {short(ours['refused'], path)}")
        else:
            notes = f"; {short('; '.join(ours['notes']), path)}" if ours["notes"] else ""
            row.append(f"{ours['points']} points, {cell_text(ours)}, {len(ours['arrays'])} arrays{notes}")
        are_all_same, is_bad = True, False
        for reader in ["vtk", "meshio"]:
            peer = found[reader]
            if "refused" in peer:
                row.append(f"refused: {short(peer['refused'], path)}")
                continue
            counts[reader] += 1
            if "refused" in ours:
                row.append(f"**opens**: {peer['points']} points, {cell_text(peer)}")
                is_bad = True
                continue
            grave, light = differences(peer, ours)
            is_judge = reader == "vtk" or "refused" in found["vtk"]  # meshio leaves cells out that VTK reads
            is_bad |= bool(grave) and is_judge
            are_all_same &= not grave and not light
            text = "; ".join([f"**{text}**" for text in grave] + light)
            row.append(text if len(text) <= 300 else text[:297] + "..." if text else "same")
            row[-1] = row[-1] or "same"
        bad += is_bad
        counts["octetra"] += "refused" not in ours
        counts["same"] += "refused" not in ours and are_all_same
        rows.append("| " + " | ".join(row) + " |")
    head = ["| file | octetra | VTK | meshio |", "|---|---|---|---|"]
    counted = f"{len(files)} files: octetra opens {counts['octetra']}, VTK {counts['vtk']}, meshio {counts['meshio']}"
    counted += f"; {counts['same']} of octetra's have nothing that differs; {bad} have points or cells that differ, or are refused though VTK or meshio opens them."
    table = "\n".join([counted, "", *head, *rows]) + "\n"
    if args.output:
        args.output.write_text(table)
        print(counted)
    else:
        print(table)
    sys.exit(1 if bad else 0)


main()
