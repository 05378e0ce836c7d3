// Whether the memory that a plan needs can be had.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "run/folder/plan.h"

namespace catoptric::run {

/// Bytes that processes can still share without swapping: what the machine has free, or what this
/// process's control groups leave if that is less. `root`: see obtainableMemory().
std::uint64_t freeMemory(const std::filesystem::path& root = "/");

/// The most memory, in bytes, that this process has had resident since its program began. `root`:
/// see obtainableMemory().
std::uint64_t peakMemory(const std::filesystem::path& root = "/");

/// The memory that this process can have in all, with what it has now.
struct ObtainableMemory {
  std::uint64_t bytes = 0;
  std::string limit;  ///< what bounds it
  bool gpu = false;   ///< whether there may be a GPU, whose own memory holds a part of plans
};

/// The least of what the machine has free, what the process's control groups leave it, and its
/// limit of address space. `root`: the folder that contains dev, proc and sys; tests have their
/// own.
ObtainableMemory obtainableMemory(const std::filesystem::path& root = "/");

/// A warning, one line each, about methods that may need more memory than can be had; or empty.
std::string memoryWarning(const Plan& plan, const ObtainableMemory& memory);

/// Throws Error (out of memory), with the largest items and the options that lower them, if a
/// method certainly needs more memory than can be had: on a GPU only methods without OpenGL do.
void requireMemory(const Plan& plan, const ObtainableMemory& memory);

}  // namespace catoptric::run
