"""What the player takes in a scene, all objects or clouds together (player/assets/scene_objects.cpp)."""

MOST_INSTANCES = 200_000
MOST_PARTICLES = 1_000_000
