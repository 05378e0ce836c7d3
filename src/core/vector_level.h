// Which vector instructions this machine has: code that is compiled for several asks here which one
// to run. Every version gives the same bits (no operation is contracted or reordered).
#pragma once

namespace catoptric {

/// The levels of the x86-64 psABI; Base is what every x86-64 has.
enum class VectorLevel { Base, V2, V3, V4 };

/// The highest of this machine, or what CATOPTRIC_VECTOR_LEVEL or limitVectorLevel() allows. The
/// first call throws UsageError where that variable names no level.
VectorLevel vectorLevel();

/// Nothing above `level` runs from now on, for tests of the versions; not above the machine's own.
void limitVectorLevel(VectorLevel level);

}  // namespace catoptric
