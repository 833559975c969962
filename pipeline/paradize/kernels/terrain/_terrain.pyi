import numpy as np
import numpy.typing as npt

def refine(
    heights: npt.NDArray[np.float32], tolerance: float, threads: int
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]: ...
def bisect(
    heights: npt.NDArray[np.float32], tolerance: float, threads: int
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]: ...
def patch(
    heights: npt.NDArray[np.float32],
    corners: tuple[tuple[int, int], tuple[int, int], tuple[int, int]],
    inside: float,
    hypotenuse: float,
    leg: float,
    most: int,
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]: ...
def vertices(
    heights: npt.NDArray[np.float32],
    pixels: npt.NDArray[np.uint32] | None,
    size_x_m: float,
    size_z_m: float,
    sand_repeat: float,
    threads: int,
) -> tuple[
    npt.NDArray[np.float32],
    npt.NDArray[np.float32],
    npt.NDArray[np.float32],
    npt.NDArray[np.float32],
    npt.NDArray[np.float32],
    npt.NDArray[np.uint32],
]: ...
