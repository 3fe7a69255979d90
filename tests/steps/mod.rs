//! A small series: cubes that carry the same field, larger or smaller.

use std::path::Path;

/// The times of [`write`]'s steps, their files, and the largest value of `p` in each; the smallest is 0.
pub const STEPS: [(f64, &str, f64); 3] = [(0.0, "flow_1.vtu", 1.0), (0.5, "flow_2.vtu", 3.0), (2.0, "flow_10.vtu", 2.0)];

/// Writes the steps and their list, `flow.pvd`.
pub fn write(folder: &Path) {
    let mut entries = String::new();
    for (time, name, largest) in STEPS {
        std::fs::write(folder.join(name), cube(&[("p", largest), ("q", 10.0 * largest)])).expect("written");
        entries += &format!("<DataSet timestep=\"{time}\" part=\"0\" file=\"{name}\"/>\n");
    }
    let list = format!("<VTKFile type=\"Collection\" version=\"0.1\"><Collection>\n{entries}</Collection></VTKFile>\n");
    std::fs::write(folder.join("flow.pvd"), list).expect("written");
}

/// The unit cube of six tets as a `.vtu` file; each array rises along x from 0 to its number.
pub fn cube(arrays: &[(&str, f64)]) -> String {
    let points: Vec<[usize; 3]> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2]).collect();
    // From corner to corner, one axis after the other, in every order.
    let tets = [[1, 2], [2, 1], [1, 4], [4, 1], [2, 4], [4, 2]].map(|[a, b]| [0, a, a + b, 7]);
    let numbers = |all: &[[usize; 3]]| all.iter().flatten().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let connectivity = tets.iter().flatten().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let data: String = arrays
        .iter()
        .map(|(name, largest)| {
            let values: Vec<String> = points.iter().map(|p| (p[0] as f64 * largest).to_string()).collect();
            format!("<DataArray type=\"Float64\" Name=\"{name}\" format=\"ascii\">{}</DataArray>", values.join(" "))
        })
        .collect();
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid><Piece NumberOfPoints=\"8\" NumberOfCells=\"6\">
<PointData>{data}</PointData>
<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points>
<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">{connectivity}</DataArray>
<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 8 12 16 20 24</DataArray>
<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10 10 10 10 10</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>\n",
        numbers(&points)
    )
}
