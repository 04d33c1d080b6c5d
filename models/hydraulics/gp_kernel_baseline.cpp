// Two lanes (SSE2 on x86-64, NEON on ARM), compiled with the flags of the rest of the program.
#include "models/hydraulics/gp_kernel_body.h"

namespace sparflow {
namespace {
typedef double Doubles __attribute__((vector_size(16)));
typedef unsigned long long Integers __attribute__((vector_size(16)));
constexpr KernelTable kTable = KernelLoops<Doubles, Integers>::table();
}  // namespace

const KernelTable& kernel_table_baseline() { return kTable; }

}  // namespace sparflow
