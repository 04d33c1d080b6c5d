// This file is compiled for its own instruction set (see CMakeLists.txt) and called only where the CPU has that set.
#include "models/hydraulics/gp_kernel_body.h"

#ifdef __x86_64__
namespace sparflow {
namespace {
typedef double Doubles __attribute__((vector_size(64)));
typedef unsigned long long Integers __attribute__((vector_size(64)));
constexpr KernelTable kTable = KernelLoops<Doubles, Integers>::table();
}  // namespace

const KernelTable& kernel_table_avx512() { return kTable; }

}  // namespace sparflow
#endif
