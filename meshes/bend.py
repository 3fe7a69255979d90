"""Makes bend.vtu and bend_coarse.vtu: laminar flow through a bent pipe, solved on tets.

    apt-get install openfoam                              # Debian: version 1912
    WM_PROJECT_DIR=/usr/share/openfoam python meshes/bend.py OUT_FOLDER

needs `pip install gmsh vtk numpy`. Lengths are pipe diameters: 1 straight up, a quarter turn of radius 2, 4 straight on. The flow comes in
with the even speed 1; by diameter and that speed the Reynolds number is 200. Values are OpenFOAM's at the cells, which its foamToVTK brings
to the points.
"""

import pathlib
import re
import subprocess
import sys

import gmsh
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

FILES = {
    "system/controlDict": """application simpleFoam; startFrom startTime; startTime 0; stopAt endTime; endTime 2000; deltaT 1;
        writeControl timeStep; writeInterval 2000; writeFormat binary; timeFormat general; runTimeModifiable false;""",
    "system/fvSchemes": """ddtSchemes { default steadyState; }
        gradSchemes { default leastSquares; }
        divSchemes { default none; div(phi,U) bounded Gauss linearUpwind default; div((nuEff*dev2(T(grad(U))))) Gauss linear; }
        laplacianSchemes { default Gauss linear limited 0.5; }
        interpolationSchemes { default linear; }
        snGradSchemes { default limited 0.5; }""",
    "system/fvSolution": """solvers {
            p { solver GAMG; smoother GaussSeidel; tolerance 1e-9; relTol 0.05; }
            U { solver smoothSolver; smoother symGaussSeidel; tolerance 1e-10; relTol 0.1; } }
        SIMPLE { consistent yes; nNonOrthogonalCorrectors 1; residualControl { p 1e-6; U 1e-6; } }
        relaxationFactors { equations { U 0.9; } }""",
    "constant/transportProperties": "transportModel Newtonian; nu 0.005;",
    "constant/turbulenceProperties": "simulationType laminar;",
    "0/U": """dimensions [0 1 -1 0 0 0 0]; internalField uniform (0 0 0);
        boundaryField { inlet { type fixedValue; value uniform (0 0 1); } outlet { type zeroGradient; } wall { type noSlip; } }""",
    "0/p": """dimensions [0 2 -2 0 0 0 0]; internalField uniform 0;
        boundaryField { inlet { type zeroGradient; } outlet { type fixedValue; value uniform 0; } wall { type zeroGradient; } }""",
}
CLASSES = {"0/U": "volVectorField", "0/p": "volScalarField"}


def mesh(size, path):
    """Tets with edges of about a size, as Gmsh's .msh 2.2, which gmshToFoam reads."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    inlet = (2, occ.addDisk(0, 0, 0, 0.5, 0.5))
    one = occ.extrude([inlet], 0, 0, 1)
    two = occ.revolve([one[0]], 2, 0, 1, 0, 1, 0, np.pi / 2)
    three = occ.extrude([two[0]], 4, 0, 0)
    occ.synchronize()
    volumes = [tag for dim, tag in one + two + three if dim == 3]
    outside = {tag for _, tag in gmsh.model.getBoundary([(3, tag) for tag in volumes], combined=True, oriented=False)}
    outlet = three[0][1]
    for name, dim, tags in [("inlet", 2, [inlet[1]]), ("outlet", 2, [outlet]), ("wall", 2, sorted(outside - {inlet[1], outlet})), ("flow", 3, volumes)]:
        gmsh.model.addPhysicalGroup(dim, tags, name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen")
    gmsh.write(str(path))
    gmsh.finalize()


def write(case):
    for name, text in FILES.items():
        path = case / name
        path.parent.mkdir(parents=True, exist_ok=True)
        header = f"FoamFile {{ version 2.0; format ascii; class {CLASSES.get(name, 'dictionary')}; object {path.name}; }}\n"
        path.write_text(header + re.sub(r"\n +", "\n", text) + "\n")


def run(case, *command):
    with open(case / f"log.{command[0]}", "w") as log:
        subprocess.run([*command, "-case", case], stdout=log, stderr=log, check=True)


def store(source, path):
    """The tets with U and p of the points, f32, packed by zlib."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(source))
    reader.Update()
    read = reader.GetOutput()
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(vtk_to_numpy(read.GetPoints().GetData()).astype(np.float32), deep=True))
    grid.SetPoints(points)
    grid.SetCells(vtk.VTK_TETRA, read.GetCells())
    for name in ["U", "p"]:
        array = numpy_to_vtk(vtk_to_numpy(read.GetPointData().GetArray(name)).astype(np.float32), deep=True)
        array.SetName(name)
        grid.GetPointData().AddArray(array)
    grid.GetPointData().SetActiveScalars("p")
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    writer.SetCompressionLevel(9)
    writer.SetBlockSize(1 << 20)
    writer.Write()


def main():
    out = pathlib.Path(sys.argv[1])
    for name, size in [("bend_coarse", 0.14), ("bend", 0.07)]:
        case = out / name
        write(case)
        mesh(size, case / "pipe.msh")
        run(case, "gmshToFoam", case / "pipe.msh")
        boundary = case / "constant/polyMesh/boundary"
        boundary.write_text(re.sub(r"(wall\s*{\s*type\s+)patch", r"\1wall", boundary.read_text()))
        run(case, "simpleFoam")
        run(case, "foamToVTK", "-latestTime", "-fields", "(U p)")
        store(next((case / "VTK").glob("*/internal.vtu")), out / f"{name}.vtu")


main()
