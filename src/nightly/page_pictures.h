// The pictures of a page, as PNG files beside it or embedded as data.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "nightly/history.h"
#include "nightly/pictures.h"

namespace catoptric::nightly {

/// The pictures of one frame that differs, as URLs; empty: none.
struct FramePictures {
  std::string accepted;
  std::string tonight;
  std::string flip;
  std::string difference;
  std::map<std::string, std::string> exposures;  ///< "accepted-under", "tonight-over", ...
  PictureComparison comparison;
};

/// A data: URL with the bytes themselves.
std::string dataAddress(const std::string& type, std::span<const std::byte> bytes);

class PictureWriter {
 public:
  /// `singleFile`: pictures are embedded as long as there is `room`, in bytes.
  PictureWriter(const History& history, std::filesystem::path folder, bool singleFile,
                std::size_t room);
  FramePictures write(const std::string& name, const FrameFacts& frame, int number,
                      const Reference* accepted);
  int leftOut() const { return leftOut_; }

 private:
  std::string add(const std::string& name, int width, int height,
                  const std::vector<std::uint8_t>& rgb);

  const History& history_;
  std::filesystem::path folder_;
  bool singleFile_;
  std::size_t room_;
  int leftOut_ = 0;
};

}  // namespace catoptric::nightly
