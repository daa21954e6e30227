"""Compares the daemon's Frangi filter with what scipy, scikit-image and ITK make of the same image.

Usage: frangi_against_peers.py PROBE [ITK_PROBE]. Exit codes: 0 all agree, 1 a difference (printed), 77 no peer is installed.

scipy and ITK take derivatives of Gaussians, as the filter claims to; with them it must agree closely. scikit-image takes
central differences over two pixels of a Gaussian image, which blur a Hessian by about two thirds of a pixel squared: its
hessian_matrix is compared at sigma^2 - 2/3, and its frangi as a user calls it, each as loosely as that asks for.
"""
import subprocess
import sys

WIDTH, HEIGHT, BETA, C = 233, 190, 0.5, 15.0
SIGMAS = (1.0, 1.5, 2.0, 3.0, 5.0)
JUMP = 0.1354  # where the eigenvalues are opposite, the formula jumps from exp(-1 / (2 beta^2)) to 0

try:
    import numpy as np
except ImportError as missing:
    print(f"SKIPPED: {missing}. The Frangi filter was NOT compared; apt-get install python3-skimage", flush=True)
    sys.exit(77)


def image():
    random = np.random.default_rng(5)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    grey = 150 + 40 * x / WIDTH
    for width, depth, phase in ((1.2, 60, 0.0), (2.0, 45, 1.5), (3.0, 40, 3.0)):
        across = (y - HEIGHT * (0.2 + 0.2 * phase) - 12 * np.sin(0.04 * x + phase)) / width
        grey -= depth * np.exp(-0.5 * across**2)
    return np.clip(np.round(grey + random.normal(0, 3, grey.shape)), 0, 255).astype(np.uint8)


def response(xx, xy, yy, sigma):
    """Frangi's formula for dark ridges; Hessian not yet scaled."""
    mean, spread = sigma**2 * (xx + yy) / 2, sigma**2 * np.hypot((xx - yy) / 2, xy)
    large, small = mean + spread, mean - spread
    ratio = np.divide(small, large, out=np.zeros_like(large), where=mean > 0)
    blob = np.exp(-ratio**2 / (2 * BETA**2))
    return np.where(mean > 0, blob * (1 - np.exp(-(large**2 + small**2) / (2 * C**2))), 0)


def scipy_frangi(grey, sigma):
    from scipy import ndimage

    def derivative(*order):
        return ndimage.gaussian_filter(grey.astype(float), sigma, order=order, mode="nearest", truncate=7)

    return response(derivative(0, 2), derivative(1, 1), derivative(2, 0), sigma)


def skimage_frangi(grey, sigma):
    from skimage.feature import hessian_matrix

    smaller = np.sqrt(sigma**2 - 2 / 3)
    yy, xy, xx = hessian_matrix(grey.astype(float), sigma=smaller, mode="nearest", order="rc")
    return response(xx, xy, yy, sigma)


def skimage_filter(grey, sigma):
    """scikit-image's own frangi(), as a user calls it."""
    from skimage.filters import frangi

    return frangi(grey.astype(float), sigmas=[sigma], beta=BETA, gamma=C, black_ridges=True, mode="nearest")


def itk_frangi(grey, sigma):
    if len(sys.argv) < 3:
        raise ImportError("no itk_hessian_probe: apt-get install libinsighttoolkit5-dev and configure again")
    command = [sys.argv[2], str(WIDTH), str(HEIGHT), str(sigma)]
    made = subprocess.run(command, input=grey.tobytes(), stdout=subprocess.PIPE, check=True, timeout=60).stdout
    xx, xy, yy = np.frombuffer(made, dtype=np.float32).reshape(3, HEIGHT, WIDTH).astype(float)
    return response(xx, xy, yy, sigma)


# For each sigma, the greatest difference and the RMS a peer may have.
CLOSE = {1.0: (0.04, 0.003), 1.5: (0.02, 0.002), 2.0: (0.015, 0.0015), 3.0: (0.008, 0.001), 5.0: (0.005, 0.001)}
CENTRAL = {1.0: (0.2, 0.012), 1.5: (0.1, 0.008), 2.0: (0.07, 0.006), 3.0: (0.04, 0.004), 5.0: (0.02, 0.002)}
BLURRED = {1.0: (0.4, 0.03), 1.5: (0.3, 0.025), 2.0: (0.2, 0.02), 3.0: (0.1, 0.015), 5.0: (0.04, 0.007)}
PEERS = (
    ("scipy.ndimage derivatives", scipy_frangi, CLOSE),
    ("skimage hessian_matrix at sigma^2 - 2/3", skimage_frangi, CENTRAL),
    ("skimage frangi", skimage_filter, BLURRED),
    ("ITK recursive Gaussian", itk_frangi, CLOSE),
)


def ours(probe, grey, sigma, smoothing):
    command = [probe, str(WIDTH), str(HEIGHT), str(sigma), str(BETA), str(C), smoothing]
    made = subprocess.run(command, input=grey.tobytes(), stdout=subprocess.PIPE, check=True, timeout=60).stdout
    return np.frombuffer(made, dtype=np.float32).reshape(HEIGHT, WIDTH)


def difference(a, b):
    """Greatest (without pixels at the formula's jump) and root mean square."""
    apart = np.abs(a - b)
    at_jump = ((a == 0) | (b == 0)) & (np.maximum(a, b) < JUMP)
    return np.max(np.where(at_jump, 0, apart)), np.sqrt(np.mean(apart**2))


def main(probe):
    grey = image()
    compared = failures = 0
    for name, peer, limits in PEERS:
        try:
            theirs = {sigma: peer(grey, sigma) for sigma in SIGMAS}
        except ImportError as missing:
            print(f"SKIPPED {name}: {missing}. It was NOT compared.", flush=True)
            continue
        for sigma in SIGMAS:
            for smoothing in ("float", "int16"):
                greatest, rms = difference(ours(probe, grey, sigma, smoothing), theirs[sigma])
                good = greatest <= limits[sigma][0] and rms <= limits[sigma][1]
                print(f"{'ok  ' if good else 'FAIL'} {name}, sigma {sigma} px, {smoothing}: "
                      f"within {greatest:.4f}, RMS {rms:.5f}")
                compared += 1
                failures += not good
    if not compared:
        return 77
    print(f"{compared} comparisons, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
