"""What the player takes in a scene, all objects or clouds together (player/assets/scene_objects.cpp)."""

FARTHEST_UV = 1e7  # tiles from 0; payload.cpp there
MOST_INSTANCES = 200_000
MOST_PARTICLES = 1_000_000
MOST_LIGHTS = 256  # lights.cpp there
MOST_LIGHT_SETS = 4096
MOST_LIGHTS_OF_A_SET = 16  # scene_file.hpp there: a draw call takes so many
MOST_RIPPLES = 512  # circles; ripples.cpp there
MOST_FLOOR_CELLS = 256  # along a side; scene_terrain.cpp there
