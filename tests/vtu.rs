//! Real `.vtu` files of other people's making.

use octetra::format::{FormatError, read_embedded, read_mesh};
use octetra::mesh::TetMesh;
use octetra::progress::Progress;
use std::path::{Path, PathBuf};

const IGNORED: &str = "OCTETRA_SHARED is the folder of shared test data";

fn data(path: &str) -> PathBuf {
    Path::new(&std::env::var("OCTETRA_SHARED").expect(IGNORED)).join("data").join(path)
}

fn load(path: &str) -> Result<TetMesh, FormatError> {
    read_mesh(&data(path), &Progress::new())
}

/// The `.vtu` files of a folder, in order.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(data(folder)).expect("the folder of shared test data");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|suffix| suffix == "vtu"));
    files.sort();
    files
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn one_mesh_in_every_encoding_is_one_mesh() {
    let expected = load("interop/spx_variants/spx_appended_raw_h32.vtu").expect("sound");
    assert_eq!((expected.points().len(), expected.tets().len()), (2896, 12_936));
    assert_eq!(expected.active_scalars(), Some("scalars"));
    let files = files("interop/spx_variants");
    assert_eq!(files.len(), 10);
    for path in files {
        let mesh = read_mesh(&path, &Progress::new()).expect("sound");
        let name = path.display();
        assert_eq!(mesh.tets(), expected.tets(), "{name}");
        // VTK's text has fewer digits than an f32.
        if path.ends_with("spx_ascii.vtu") {
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * (1.0 + a.abs());
            assert!(mesh.points().iter().zip(expected.points()).all(|(a, b)| (a - b).abs().max_element() < 1e-4), "{name}");
            let (a, b) = (&mesh.point_data()[0].values, &expected.point_data()[0].values);
            assert!((0..a.len()).all(|i| near(a.get(i), b.get(i))), "{name}");
        } else {
            assert!(mesh.points() == expected.points() && mesh.center() == expected.center(), "{name}");
            assert!(mesh.point_data() == expected.point_data(), "{name}");
        }
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn meshes_have_the_counts_of_their_inventory() {
    for (path, points, tets, zero_volume, arrays) in [
        ("tet/blunt_fin.vtu", 40_960, 187_395, 77, 4),
        ("tet/blunt_fin_zlib.vtu", 40_960, 187_395, 77, 4),
        ("tet/spx1_refined_zlib.vtu", 20_108, 103_488, 0, 1),
        ("tet/spx2_refined_zlib.vtu", 149_224, 827_904, 0, 1),
        ("interop/vtk/Tetrahedron.vtu", 35, 96, 0, 2),
        ("interop/vtk/chaste_monodomain3d_0.vtu", 847, 3600, 0, 51),
        ("interop/vtk/cells/Tetra.vtu", 4, 1, 0, 0),
        ("interop/vtkio/tet.vtu", 4, 1, 0, 2),
        ("surface/tetwild/fandisk_e0.05_eps0.001.vtu", 1485, 5591, 0, 1),
        ("surface/tetwild/fandisk_e0.1_eps0.002.vtu", 744, 2590, 0, 1),
        ("surface/tetwild/fertility_e0.1_eps0.002.vtu", 3887, 14_199, 0, 1),
        ("surface/tetwild/lever_e0.05_eps0.001.vtu", 1062, 3304, 0, 1),
        ("surface/tetwild/lever_e0.1_eps0.002.vtu", 538, 1383, 0, 1),
        ("surface/tetwild/rocker-arm_e0.05_eps0.001.vtu", 7653, 28_826, 0, 1),
        ("surface/tetwild/rocker-arm_e0.1_eps0.002.vtu", 3471, 12_567, 0, 1),
        ("surface/tetwild/screwdriver_e0.1_eps0.002.vtu", 2372, 8303, 0, 1),
    ] {
        let mesh = load(path).expect("sound");
        let found = (mesh.points().len(), mesh.tets().len(), mesh.zero_volume_count(), mesh.point_data().len() + mesh.cell_data().len());
        assert_eq!(found, (points, tets, zero_volume, arrays), "{path}");
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn arrays_have_the_ranges_of_their_inventory() {
    for (path, name, components, range) in [
        ("tet/blunt_fin.vtu", "density", 1, [0.1926, 4.9775]),
        ("tet/blunt_fin_zlib.vtu", "momentum", 3, [-3.7339, 5.7903]),
        ("tet/spx2_refined_zlib.vtu", "scalars", 1, [0.0, 2.254]),
        ("surface/tetwild/fertility_e0.1_eps0.002.vtu", "dist_to_surface", 1, [0.0, 19.675]),
    ] {
        let mesh = load(path).expect("sound");
        let array = mesh.point_data().iter().find(|array| array.name == name).expect("the array");
        let all = (0..array.values.len()).map(|i| array.values.get(i));
        let found = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        assert_eq!(array.components, components);
        assert!((0..2).all(|i| (found[i] - range[i]).abs() < 1e-4 * (1.0 + range[i].abs())), "{path}: {found:?}");
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn other_cells_become_tets() {
    // By the rules of mesh/to_tets; of the crushed can 29 cells are not convex, so that their 12 tets meet in the middle.
    for (path, cells, tets) in [
        ("tet/kiefer_dataset.vtu", "quadratic tetrahedron", 56_786 * 8),
        ("interop/hex_wedge/can.vtu", "hexahedron", 4_771 * 6 + 29 * 12),
        ("interop/vtk/QuadraticTetra.vtu", "quadratic tetrahedron", 96 * 8),
        ("interop/vtk/QuadraticPyramid.vtu", "quadratic pyramid", 48 * 16),
        ("interop/vtk/QuadraticWedge.vtu", "quadratic wedge", 16 * 24),
        ("interop/vtk/TriQuadraticHexahedron.vtu", "triquadratic hexahedron", 7 * 48),
        ("interop/vtk/quadraticTetra01.vtu", "quadratic tetrahedron", 8),
        ("interop/vtk/cells/HexagonalPrism.vtu", "hexagonal prism", 12),
    ] {
        let mesh = load(path).expect("sound");
        assert_eq!((mesh.file_cells().cell_type(0).name().0, mesh.tets().len()), (cells, tets), "{path}");
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn every_file_loads_or_has_no_cell_with_a_volume() {
    let folders =
        ["tet", "interop/vtk", "interop/vtk/cells", "interop/vtkio", "interop/vtkio/pygmsh", "interop/hex_wedge", "surface/tetwild"];
    for path in folders.into_iter().flat_map(files) {
        if let Err(error) = read_mesh(&path, &Progress::new()) {
            let error = error.to_string();
            assert!(error.starts_with(&format!("{}: has no cell with a volume: it holds ", path.display())), "{error}");
        }
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn a_truncated_file_is_an_error() {
    for path in
        ["tet/blunt_fin.vtu", "tet/blunt_fin_zlib.vtu", "interop/spx_variants/spx_ascii.vtu", "interop/spx_variants/spx_appended_lzma.vtu"]
    {
        let bytes = std::fs::read(data(path)).expect("the file");
        for i in 0..200 {
            let len = bytes.len() * i / 200;
            let error = read_embedded("cut.vtu", &bytes[..len], &Progress::new()).expect_err("truncated").to_string();
            assert!(error.starts_with("cut.vtu: "), "{error}");
        }
    }
}

#[test]
fn what_cannot_be_a_mesh_is_said_with_its_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let read = |name: &str, content: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("written");
        let error = read_mesh(&path, &Progress::new()).expect_err(name).to_string();
        error.strip_prefix(&format!("{}: ", path.display())).expect("the file's name").to_owned()
    };
    assert!(read("a.stp", "ISO-10303-21;").starts_with("its format is not known; octetra reads VTK XML unstructured grid (.vtu), "));
    assert!(read("a.vtu", "solid").starts_with("this is not a .vtu file"));
    assert!(read("a.vtu", "").starts_with("this is not a .vtu file"));
    let empty =
        "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='0' NumberOfCells='0'/></UnstructuredGrid></VTKFile>";
    assert_eq!(read("by_content", empty), "the mesh has no tetrahedra");
    let missing = folder.path().join("missing.vtu");
    assert!(read_mesh(&missing, &Progress::new()).is_err_and(|e| e.to_string().starts_with(&missing.display().to_string())));
    assert!(read_mesh(folder.path(), &Progress::new()).is_err_and(|e| e.to_string().ends_with("not a regular file")));
}
