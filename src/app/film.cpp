#include "app/film.h"

#include <fmt/core.h>
#include <sys/wait.h>

#include <cstdlib>

#include "core/error.h"
#include "core/log.h"
#include "core/text.h"

namespace catoptric::app {
namespace {

/// Frames per second of a film, as of the paths of our scenes.
constexpr int kFilmRate = 30;

std::filesystem::path folderOf(const std::filesystem::path& film) {
  return film.string() + ".frames";
}

}  // namespace

void requireNoFilm(const std::filesystem::path& film) {
  for (const std::filesystem::path& file : {film, folderOf(film)})
    if (std::filesystem::exists(file))
      throw UsageError("--video " + film.string() + ": " + file.string() +
                       " exists; remove it or choose another name");
}

std::filesystem::path newFilmFolder(const std::filesystem::path& film) {
  requireNoFilm(film);
  std::filesystem::path pictures = folderOf(film);
  std::filesystem::create_directories(pictures);
  return pictures;
}

void makeFilm(const std::filesystem::path& film) {
  const std::filesystem::path pictures = folderOf(film);
  const std::string command = fmt::format(
      "ffmpeg -nostdin -y -loglevel error -framerate {} -i {} -vf {} -pix_fmt yuv420p {}",
      kFilmRate, shellWord((pictures / "%04d.png").string()),
      shellWord("pad=ceil(iw/2)*2:ceil(ih/2)*2"), shellWord(film.string()));
  const int status = std::system(command.c_str());
  if (status == 0) {
    log::info("film: " + film.string());
    std::filesystem::remove_all(pictures);
    return;
  }
  constexpr int kNotFound = 127;  // of a shell
  const bool missing = WIFEXITED(status) && WEXITSTATUS(status) == kNotFound;
  log::warning(film.string() +
               (missing ? ": there is no ffmpeg here. With it, this command makes the film: "
                        : ": ffmpeg failed, its message is above. The command: ") +
               command);
}

}  // namespace catoptric::app
