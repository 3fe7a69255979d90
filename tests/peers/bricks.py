"""Reads the stores of `octetra bricks` with zarr-python, and compares them with their sources.

    python tests/peers/bricks.py target/release/octetra ../shared      needs zarr and numpy from PyPI, and segyio for the surveys

Of each source a store is written to a temporary folder. Checked: level 0 is the source, number by number; every further level is the mean
of the one before; scale and place of the levels by OME-NGFF 0.5; what is known of the bricks; slices of octetra are the source's. Exit status 1
if anything differs.
"""

import gzip
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import zarr

failures = 0


def check(what, holds):
    global failures
    if not holds:
        failures += 1
        print(f"  DIFFERS: {what}")


def halved(a):
    """The mean of the known of each 2 x 2 x 2 voxels, or of those there are at the end."""
    padded = np.pad(a.astype(np.float64), [(0, n % 2) for n in a.shape], constant_values=np.nan)
    z, y, x = (n // 2 for n in padded.shape)
    with np.errstate(invalid="ignore"):
        known = ~np.isnan(parts := padded.reshape(z, 2, y, 2, x, 2))
        mean = np.where(known, parts, 0).sum((1, 3, 5)) / known.sum((1, 3, 5))
    return mean if a.dtype.kind == "f" else np.floor(np.abs(mean) + 0.5) * np.sign(mean)


def entropy(brick):
    known = brick[~np.isnan(brick)].astype(np.float64)
    low, high = known.min(), known.max()
    if low == high:
        return 0.0
    scale = 1.0 if brick.dtype.kind != "f" and high - low < 256 else 256 / (high - low)
    counts = np.bincount(np.minimum(((known - low) * scale).astype(int), 255))
    p = counts[counts > 0] / len(known)
    return float(-(p * np.log2(p)).sum())


def compare(octetra, source, volume, folder, *flags):
    print(source.name, volume.dtype, volume.shape)
    store = folder / f"{source.name}.zarr"
    subprocess.run([octetra, "bricks", source, "-o", store, *flags], check=True, stdout=subprocess.DEVNULL)
    root = zarr.open_group(store, mode="r")
    datasets = root.attrs["ome"]["multiscales"][0]["datasets"]
    check("OME version", root.attrs["ome"]["version"] == "0.5")
    level = volume
    for number, dataset in enumerate(datasets):
        array = root[dataset["path"]]
        found = array[:]
        check(f"type of level {number}", found.dtype == volume.dtype)
        check(f"shape of level {number}", found.shape == level.shape)
        tolerance = 0 if number == 0 or volume.dtype.kind != "f" else 1e-6 * np.nanmax(np.abs(volume))
        check(f"level {number}", np.allclose(found, level, rtol=0, atol=tolerance, equal_nan=True))
        scale, translation = (t.get("scale") or t.get("translation") for t in dataset["coordinateTransformations"])
        first = datasets[0]["coordinateTransformations"][0]["scale"]
        check(f"scale of level {number}", np.allclose(scale, np.array(first) * 2**number))
        start = datasets[0]["coordinateTransformations"][1]["translation"]
        check(f"place of level {number}", np.allclose(translation, np.array(start) + np.array(first) * (2**number - 1) / 2))
        statistics = root[f"statistics/{number}"][:]
        for z, y, x in np.ndindex(*statistics.shape[:3]):
            fine = volume[tuple(slice(64 * i << number, 64 * (i + 1) << number) for i in (z, y, x))]
            own = found[tuple(slice(64 * i, 64 * (i + 1)) for i in (z, y, x))]
            if np.isnan(fine).all():
                check(f"brick {x, y, z} of level {number} holds nothing", np.isnan(statistics[z, y, x, :2]).all())
                continue
            expected = [np.nanmin(fine), np.nanmax(fine), entropy(own), 1 - np.isnan(fine).mean()]
            check(f"statistics of brick {x, y, z} of level {number}: {statistics[z, y, x]} {expected}",
                  np.allclose(statistics[z, y, x], expected, rtol=1e-6, atol=1e-9))
        level = halved(found).astype(volume.dtype)
    for axis, n in zip("zyx", volume.shape):
        at = n // 3
        subprocess.run([octetra, "slice", store, "--voxel", f"{axis}={at}", "--nearest", "-o", folder / "slice.npy"], check=True,
                       stdout=subprocess.DEVNULL)
        expected = np.take(volume, at, "zyx".index(axis))[::-1]
        check(f"slice {axis}={at}", np.array_equal(np.load(folder / "slice.npy"), expected.astype(np.float64), equal_nan=True))
    info = root.attrs["octetra"]
    check("range", np.allclose(info["range"], [np.nanmin(volume), np.nanmax(volume)]))


def survey(path):
    import segyio

    endian = "little" if "lsb" in path.name else "big"
    with segyio.open(path, endian=endian) as file:
        return np.ascontiguousarray(segyio.cube(file)) if len(file.offsets) == 1 else None


def main():
    octetra, data = Path(sys.argv[1]).resolve(), Path(sys.argv[2]) / "data"
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        with gzip.open(data / "volume/teapot_256x256x178.raw.gz") as file:
            teapot = np.frombuffer(file.read(), np.uint8).reshape(178, 256, 256)
        compare(octetra, data / "volume/teapot_256x256x178.nhdr", teapot, folder)
        random = np.random.default_rng(5)
        waves = (np.sin(np.arange(150) / 9)[:, None, None] * np.cos(np.arange(201) / 7)[:, None] + random.normal(0, 0.1, 130)).astype(np.float32)
        waves[:70, :70, :70] = np.nan
        waves.tofile(folder / "waves.raw")
        z, y, x = waves.shape
        compare(octetra, folder / "waves.raw", waves, folder, "--dims", f"{x},{y},{z}", "--type", "f32", "--spacing", "0.5,1,2", "--memory", "60MiB")
        for path in sorted((data / "seismic").rglob("*.s*gy")):
            try:
                cube = survey(path)
            except (RuntimeError, ValueError, OSError) as error:
                print(f"{path.name}: segyio: {error}")
                continue
            if cube is not None:
                compare(octetra, path, cube, folder)
    print("differences:", failures)
    return failures > 0


if __name__ == "__main__":
    sys.exit(main())
