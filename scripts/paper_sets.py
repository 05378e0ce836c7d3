"""The frames on which second_order's constants were chosen (tuning), and frames and scenes on which no constant
was ever chosen (validation). Whoever chooses a constant looks at the tuning set alone; the tables judge on both.

A constant that is chosen on anything else moves that into the tuning set. Never the other way round."""
ROOMS = {"living room a": ("living_room", "living_room_a"),
         "living room b": ("living_room", "living_room_b"),
         "bathroom a": ("bathroom", "bathroom_a"), "bathroom b": ("bathroom", "bathroom_b")}

# Rows: name, scene, path, first frame, last frame, step.
TUNING = [
    *((name, scene, path, 45, 900, 90) for name, (scene, path) in ROOMS.items()),
    ("glossy sphere", "glossy_sphere", "glossy_sphere", 4, 16, 6),
    ("normal mapped", "normal_mapped", "normal_mapped", 4, 12, 4),
    ("moving", "moving", "moving", 4, 24, 8),
    ("teapots", "teapots", "teapots", 4, 16, 6),
    ("nine spheres", "nine_spheres", "nine_spheres", 4, 24, 8),
]
# Lenses are not among them: second_order mirrors what refracts, `traced` refracts it.
VALIDATION = [
    *((name, scene, path, 17, 900, 90) for name, (scene, path) in ROOMS.items()),
    ("deforming", "deforming", "deforming", 4, 24, 8),
    ("Cornell box", "cornell_box", "cornell_box", 4, 12, 4),
    ("vase and sphere", "vase_sphere", "vase_sphere", 4, 24, 8),
    ("vase and lizard", "vase_lizard", "vase_lizard", 4, 24, 8),
    ("vase and window", "vase_window", "vase_window", 4, 48, 16),
    ("user's formula", "user_formula", "user_formula", 4, 24, 8),
]
SETS = {"tuning": TUNING, "validation": VALIDATION}


def frames_of(row):
    """Numbers of a row's frames."""
    first, last, step = row[3:]
    return list(range(first, last + 1, step))
