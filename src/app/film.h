// Films by ffmpeg.
#pragma once

#include <filesystem>

namespace catoptric::app {

/// Throws UsageError if a film, or the folder for its pictures, exists.
void requireNoFilm(const std::filesystem::path& film);

/// Makes the folder for the pictures 0001.png, 0002.png, ... of a film, after requireNoFilm().
std::filesystem::path newFilmFolder(const std::filesystem::path& film);

/// Makes a film of the pictures in newFilmFolder(film), and removes them. Without ffmpeg they stay,
/// and a message has the command that makes the film.
void makeFilm(const std::filesystem::path& film);

}  // namespace catoptric::app
