#include "app/film.h"

#include <fmt/core.h>

#include <cstdlib>

#include "core/log.h"
#include "core/text.h"

namespace catoptric::app {
namespace {

/// Frames per second of a film, as of the paths of our scenes.
constexpr int kFilmRate = 30;

std::filesystem::path folderOf(const std::filesystem::path& film) {
  return film.string() + ".frames";
}

std::string commandOf(const std::filesystem::path& film) {
  return fmt::format(
      "ffmpeg -nostdin -y -loglevel error -framerate {} -i {} -vf {} -pix_fmt yuv420p {}",
      kFilmRate, shellWord((folderOf(film) / "%04d.png").string()),
      shellWord("pad=ceil(iw/2)*2:ceil(ih/2)*2"), shellWord(film.string()));
}

bool haveFfmpeg() {
  return std::system("command -v ffmpeg >/dev/null") == 0;
}

}  // namespace

void checkFilm(const std::filesystem::path& film, bool again) {
  for (const std::filesystem::path& file : {film, folderOf(film)})
    if (std::filesystem::exists(file) && !(again && file != film))
      throw UsageError("--video " + film.string() + ": " + file.string() +
                       " exists; remove it or choose another name");
  if (!haveFfmpeg())
    log::warning("--video " + film.string() +
                 ": there is no ffmpeg here. With it, this command makes the film of the pictures "
                 "that this run will leave: " +
                 commandOf(film));
}

std::filesystem::path newFilmFolder(const std::filesystem::path& film) {
  std::filesystem::path pictures = folderOf(film);
  std::filesystem::remove_all(pictures);
  std::filesystem::create_directories(pictures);
  return pictures;
}

ExitCode makeFilm(const std::filesystem::path& film) {
  const std::string command = commandOf(film);
  const bool have = haveFfmpeg();
  if (have && std::system(command.c_str()) == 0) {
    log::info("film: " + film.string());
    std::filesystem::remove_all(folderOf(film));
    return ExitCode::Done;
  }
  log::error(film.string() +
             (have ? ": ffmpeg failed, its message is above. The command: "
                   : ": not made, for want of ffmpeg. With it, this command makes the film: ") +
             command);
  return ExitCode::Output;
}

}  // namespace catoptric::app
