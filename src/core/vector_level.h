// The level of vector instructions that this machine has. Code that is compiled for several levels
// asks here which version to run. All versions give bit-identical results: no operation is
// contracted or reordered.
#pragma once

namespace catoptric {

/// The levels of the x86-64 psABI. Every x86-64 processor has Base.
enum class VectorLevel { Base, V2, V3, V4 };

/// The highest level of this machine, limited by CATOPTRIC_VECTOR_LEVEL and limitVectorLevel(). The
/// first call throws UsageError if that variable names no level.
VectorLevel vectorLevel();

/// Limits the level from now on, for tests of the versions. It never exceeds the machine's level.
void limitVectorLevel(VectorLevel level);

}  // namespace catoptric
