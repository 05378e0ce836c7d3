// Films by ffmpeg.
#pragma once

#include <filesystem>

#include "core/error.h"

namespace catoptric::app {

/// Throws UsageError if a film, or the folder for its pictures, exists; with `again`, that folder
/// is an earlier try's and may. Without ffmpeg, a warning has the command that makes the film
/// later.
void checkFilm(const std::filesystem::path& film, bool again);

/// Makes the folder for the pictures 0001.png, 0002.png, ... of a film, after checkFilm().
std::filesystem::path newFilmFolder(const std::filesystem::path& film);

/// Makes a film of the pictures in newFilmFolder(film), and removes them. If that fails they stay,
/// and an error has the command that makes the film.
ExitCode makeFilm(const std::filesystem::path& film);

}  // namespace catoptric::app
