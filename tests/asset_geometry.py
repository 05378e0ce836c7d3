#!/usr/bin/python3
"""Tests of scripts/assets/geometry.py: which layers of a model go, which sheets it has.

usage: asset_geometry.py SOURCE_DIR
"""

import os
import sys
import unittest

sys.dont_write_bytecode = True
SOURCE = sys.argv.pop(1)
sys.path.insert(0, os.path.join(SOURCE, "scripts", "assets"))

import geometry  # noqa: E402


def grid(cells, z, size=1.0, shift=0.0):
    """A square of cells x cells x 2 triangles in the plane z, from (shift, 0)."""

    def corner(i, j):
        return ((shift + size * i / cells, size * j / cells, z), None, (0.0, 0.0))

    triangles = []
    for i in range(cells):
        for j in range(cells):
            a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
            triangles += [[a, b, c], [a, c, d]]
    return triangles


def wall(x, low, high):
    """A strip of one quad at x, from z = low to z = high, along y in [0, 1]."""
    a, b, c, d = [((x, y, z), None, (0.0, 0.0)) for y, z in ((0, low), (1, low), (1, high), (0, high))]
    return [[a, b, c], [a, c, d]]


class Covered(unittest.TestCase):
    def test_the_smaller_of_two_layers_goes_whole(self):
        triangles = grid(4, 0.0) + grid(3, 0.0001, size=0.9)
        self.assertEqual(geometry.covered(triangles, 0.0005, set()), set(range(32, 50)))

    def test_layers_farther_apart_than_the_gap_stay(self):
        triangles = grid(4, 0.0) + grid(3, 0.001, size=0.9)
        self.assertEqual(geometry.covered(triangles, 0.0005, set()), set())

    def test_what_reaches_beyond_the_other_layer_stays(self):
        triangles = grid(1, 0.0) + grid(1, 0.0001, shift=0.5)
        self.assertEqual(geometry.covered(triangles, 0.0005, set()), set())

    def test_of_equal_layers_one_stays(self):
        triangles = grid(2, 0.0) + grid(2, 0.0001)
        gone = geometry.covered(triangles, 0.0005, set())
        self.assertIn(gone, (set(range(8)), set(range(8, 16))))

    def test_those_to_be_tried_last_stay(self):
        for last in (range(8), range(8, 16)):
            triangles = grid(2, 0.0) + grid(2, 0.0001)
            gone = geometry.covered(triangles, 0.0005, set(last))
            self.assertEqual(gone, set(range(16)) - set(last))

    def test_surfaces_across_each_other_stay(self):
        self.assertEqual(geometry.covered(grid(2, 0.0) + wall(0.5, -0.5, 0.5), 0.0005, set()), set())


class Sheets(unittest.TestCase):
    def test_triangles_that_share_a_position_are_one_sheet(self):
        self.assertEqual(geometry.sheets_of(grid(2, 0.0) + grid(1, 1.0)), [0] * 8 + [1] * 2)
        self.assertEqual(geometry.sheets_of(grid(1, 0.0) + grid(1, 0.0, shift=1.0)), [0] * 4)

    def test_smooth_sheets_end_where_the_surface_bends(self):
        # Two sides of 2 triangles and a rim of 2 between them, all sharing edges.
        triangles = grid(1, 0.0) + wall(1.0, 0.0, 0.01) + grid(1, 0.01)
        sheets = [sorted(sheet) for sheet in geometry.smooth_sheets(triangles, 30)]
        self.assertCountEqual(sheets, [[0, 1], [2, 3], [4, 5]])
        self.assertEqual(len(geometry.smooth_sheets(triangles, 170)), 1)

    def test_smooth_sheets_are_sorted_by_size(self):
        sheets = geometry.smooth_sheets(grid(1, 0.0) + grid(3, 1.0), 30)
        self.assertEqual([len(sheet) for sheet in sheets], [18, 2])


if __name__ == "__main__":
    unittest.main(verbosity=2)
