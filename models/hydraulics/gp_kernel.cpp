#include "models/hydraulics/gp_kernel.h"

#include <atomic>
#include <cstdlib>
#include <cstring>

#include "models/hydraulics/gp_kernel_table.h"

namespace sparflow {
namespace {

constexpr KernelIsa kAll[] = {KernelIsa::kBaseline, KernelIsa::kAvx2, KernelIsa::kAvx512};

const KernelTable& table_of(KernelIsa isa) {
#ifdef __x86_64__
  if (isa == KernelIsa::kAvx2) return kernel_table_avx2();
  if (isa == KernelIsa::kAvx512) return kernel_table_avx512();
#endif
  (void)isa;
  return kernel_table_baseline();
}

KernelIsa first_choice() {
  if (const char* wanted = std::getenv("SPARFLOW_ISA")) {
    for (KernelIsa isa : kAll) {
      if (std::strcmp(wanted, kernel_isa_name(isa)) == 0 && kernel_isa_available(isa)) return isa;
    }
  }
  KernelIsa best = KernelIsa::kBaseline;
  for (KernelIsa isa : kAll) {
    if (kernel_isa_available(isa)) best = isa;
  }
  return best;
}

// A null table means "not chosen yet"; every thread that finds it so makes the same choice.
std::atomic<const KernelTable*> g_table{nullptr};

const KernelTable& table() {
  const KernelTable* chosen = g_table.load(std::memory_order_acquire);
  if (chosen == nullptr) {
    chosen = &table_of(first_choice());
    g_table.store(chosen, std::memory_order_release);
  }
  return *chosen;
}

}  // namespace

bool kernel_isa_available(KernelIsa isa) {
  if (isa == KernelIsa::kBaseline) return true;
#ifdef __x86_64__
  const bool fma = __builtin_cpu_supports("fma") != 0;
  if (isa == KernelIsa::kAvx2) return fma && __builtin_cpu_supports("avx2") != 0;
  return fma && __builtin_cpu_supports("avx512f") != 0;
#else
  return false;
#endif
}

const char* kernel_isa_name(KernelIsa isa) {
  switch (isa) {
    case KernelIsa::kAvx2:
      return "avx2";
    case KernelIsa::kAvx512:
      return "avx512";
    default:
      return "baseline";
  }
}

KernelIsa kernel_isa() {
  const KernelTable* used = &table();
  for (KernelIsa isa : kAll) {
    if (kernel_isa_available(isa) && &table_of(isa) == used) return isa;
  }
  return KernelIsa::kBaseline;
}

bool set_kernel_isa(KernelIsa isa) {
  if (!kernel_isa_available(isa)) return false;
  g_table.store(&table_of(isa), std::memory_order_release);
  return true;
}

double kernel_sum(const KernelCentres& centres, double x, double y) {
  return table().sum(centres, x, y);
}

KernelSums kernel_sum_derivatives(const KernelCentres& centres, double x, double y) {
  return table().sum_derivatives(centres, x, y);
}

void kernel_vector(const KernelCentres& centres, double x, double y, double* out) {
  table().vector(centres, x, y, out);
}

}  // namespace sparflow
