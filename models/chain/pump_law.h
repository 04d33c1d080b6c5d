#pragma once
/// The law of a load-sensing pump (paper eqs. 14-16), in the one place where it is written:
///   p = max(standby, max over moving cylinders i of d_i),   demand d_i = P_i + c_i + what effects add,
/// exact, and smooth for the solver:
///   p = beta log(exp(standby/beta) + sum_i exp(d_i/beta)), which exceeds the maximum by at most beta log(n+1).
/// Whoever needs the law calls it. Copies that are independent on purpose are held against it: that of the simulator by
/// tests/simulator/largest_demand_test.cpp, that of the reference NLP by tests/bench/reference_nlp_test.cpp, that on
/// ADOL-C's tape by tests/bench/taped_law_test.cpp. Nothing is allocated; callers keep demands in containers of their own.
#include <cmath>
#include <vector>

#include "models/math/scalar.h"

namespace sparflow {

/// The exact law of one pump at one instant; demands are added one after another.
class PumpLaw {
 public:
  /// @param standby [Pa]; of a constant-pressure supply its pressure, and then no demand is added
  explicit PumpLaw(double standby) : pressure_(standby) {}

  /// Adds a demand [Pa]. It leads only above standby and all earlier ones: of equal demands the first leads. NaN, which in a
  /// log stands for a cylinder at rest, demands nothing.
  /// @param cylinder its index, or any other name that the caller wants back from leader()
  void add(int cylinder, double demand) {
    if (!(demand > pressure_)) return;
    pressure_ = demand;
    leader_ = cylinder;
  }
  double pressure() const { return pressure_; }  ///< [Pa]
  int leader() const { return leader_; }         ///< load-sensing leader, -1 = standby

 private:
  double pressure_;
  int leader_ = -1;
};

/// The exact law with one demand. With the pressure of earlier demands in place of standby it adds one more. [Pa]
inline double pump_pressure(double standby, double demand) {
  PumpLaw law(standby);
  law.add(0, demand);
  return law.pressure();
}

/// One cylinder in the smooth law: where its demand is found, and where its share goes.
template <class T>
struct SmoothDemand {
  const T* demand = nullptr;  ///< [Pa]; nullptr = demands nothing
  T* share =
      nullptr;  ///< [-] weight of this demand in the soft maximum; unchanged without a demand
};

template <class T>
struct SmoothPumpPressure {
  T pressure;       ///< [Pa]
  T standby_share;  ///< [-] the shares of standby and of all demands have sum one
  int leader = -1;  ///< load-sensing leader of the exact law, -1 = standby
};

/// The smooth law of one pump at one instant, for plain numbers and Jets.
struct SmoothPumpLaw {
  double standby = 0.0;  ///< [Pa]
  double beta = 1e5;  ///< [Pa] smoothing; 0: the exact maximum, with the derivatives of its leader

  /// The largest term is factored out, so that no exponential overflows.
  /// @param cylinders those that the pump feeds  @param demand_of returns the SmoothDemand of a cylinder
  template <class T, class DemandOf>
  SmoothPumpPressure<T> pressure(const std::vector<int>& cylinders,
                                 const DemandOf& demand_of) const {
    using std::exp;
    using std::log;
    PumpLaw exact(standby);
    for (const int i : cylinders) {
      const SmoothDemand<T> one = demand_of(i);
      if (one.demand != nullptr) exact.add(i, plain(*one.demand));
    }
    const double top = exact.pressure();
    if (!(beta > 0.0)) return exact_pressure<T>(exact.leader(), cylinders, demand_of);
    T standby_share = std::exp((standby - top) / beta);
    T total = standby_share;
    for (const int i : cylinders) {
      const SmoothDemand<T> one = demand_of(i);
      if (one.demand == nullptr) continue;
      *one.share = exp((*one.demand - T(top)) / beta);
      total += *one.share;
    }
    for (const int i : cylinders) {
      const SmoothDemand<T> one = demand_of(i);
      if (one.demand != nullptr) *one.share /= total;
    }
    standby_share /= total;
    return {top + beta * log(total), standby_share, exact.leader()};
  }

 private:
  template <class T, class DemandOf>
  SmoothPumpPressure<T> exact_pressure(int leader, const std::vector<int>& cylinders,
                                       const DemandOf& demand_of) const {
    SmoothPumpPressure<T> law{T(standby), T(leader < 0 ? 1.0 : 0.0), leader};
    for (const int i : cylinders) {
      const SmoothDemand<T> one = demand_of(i);
      if (one.demand == nullptr) continue;
      *one.share = T(i == leader ? 1.0 : 0.0);
      if (i == leader) law.pressure = *one.demand;
    }
    return law;
  }
};

}  // namespace sparflow
