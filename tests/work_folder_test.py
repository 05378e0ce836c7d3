#!/usr/bin/env python3
"""Asks for a fresh work folder again and again while a left-over program goes on writing to the place.
Usage: work_folder_test.py WORK_FOLDER"""

import sys
import threading

sys.dont_write_bytecode = True
from work_folder import fresh  # noqa: E402


def main(place):
    old = fresh(place)
    over = threading.Event()

    def write():
        number = 0
        while not over.is_set():
            number += 1
            folder = old / str(number % 50)
            try:
                folder.mkdir(parents=True, exist_ok=True)
                (folder / "frame").write_bytes(b"x")
            except OSError:  # removed meanwhile
                pass

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(20):
            folder = fresh(place)
            if folder == old or list(folder.iterdir()):
                print(f"{folder} is not fresh")
                return 1
    finally:
        over.set()
        writer.join()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
