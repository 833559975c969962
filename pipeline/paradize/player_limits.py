"""The limits of the player in a scene, all objects or clouds together (player/assets/).
Pairs are the least and the largest value."""

VIEWS = ("camera", "shadow", "reflection", "refraction")  # that an object may be drawn in
LARGEST_M = 1e7  # radius of an object's mesh, and a coordinate from the mesh's own origin
FARTHEST_UV = 1e7  # tiles from 0; payload.cpp there
SCALES = (1e-6, 1e6)  # of an instance along an axis; mirrored: negative
FLIGHT_S = (1e-3, 86_400.0)
FOV_RAD = (1e-3, 3.1)
NEAR_M, FAR_M = (1e-5, 1e7), (1e-4, 1e8)
DEPTH_RANGE = 20000.0  # far over near: depth has 24 bits
MOST_INSTANCES = 200_000
MOST_PARTICLES = 1_000_000
MOST_LIGHTS = 256  # scene/lights.cpp there
MOST_LIGHT_SETS = 4096
MOST_LIGHTS_OF_A_SET = 16  # scene/file.hpp there: a draw call takes so many
MOST_RIPPLES = 512  # circles; scene/ripples.cpp there
MOST_FLOOR_CELLS = 256  # along a side; scene/terrain.cpp there
