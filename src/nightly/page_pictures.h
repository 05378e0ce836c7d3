// Pictures of a page: PNG files beside it, or data in it.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "nightly/history.h"
#include "nightly/pictures.h"

namespace catoptric::nightly {

/// One frame that differs: what its figure shows. Addresses of pictures; empty: none.
struct FramePictures {
  std::string accepted;
  std::string tonight;
  std::string flip;
  std::string difference;
  std::map<std::string, std::string> exposures;  ///< "accepted-under", "tonight-over", ...
  PictureComparison comparison;
};

/// An address that is the bytes themselves.
std::string dataAddress(const std::string& type, std::span<const std::byte> bytes);

class PictureWriter {
 public:
  /// In a single file pictures are data, as long as they have room.
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
