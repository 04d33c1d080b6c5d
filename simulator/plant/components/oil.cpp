#include "simulator/plant/components/oil.h"

namespace sparflow::plant {
namespace {

constexpr double kFloor = 5e3;  // [Pa] absolute; a state below it is an overshoot of the integrator
constexpr double kKelvin = 273.15;

}  // namespace

Oil::Oil(const OilParameters& p) : p_(p) {
  const auto z = [this](double viscosity) {
    return std::log10(std::log10(1e6 * viscosity + viscosity_offset_));
  };
  const double t40 = std::log10(40.0 + kKelvin), t100 = std::log10(100.0 + kKelvin);
  walther_b_ = (z(p.viscosity_40) - z(p.viscosity_100)) / (t100 - t40);
  walther_a_ = z(p.viscosity_40) + walther_b_ * t40;
  floor_ = mixture(kFloor);
  floor_slope_ = -floor_.volume / floor_.modulus;
}

Oil::Properties Oil::mixture(double absolute) const {
  const double gauge = absolute - kAtmosphere;
  const double liquid = (1.0 - p_.air_fraction) * std::exp(-gauge / p_.bulk_modulus);
  Properties r{};
  r.volume = liquid;
  double slope = -liquid / p_.bulk_modulus;
  r.flow_work = p_.bulk_modulus * (1.0 - p_.air_fraction - liquid);
  if (p_.air_fraction > 0.0) {
    const double air = p_.air_fraction * std::pow(kAtmosphere / absolute, 1.0 / p_.polytropic);
    r.volume += air;
    slope -= air / (p_.polytropic * absolute);
    r.flow_work += (air * absolute - p_.air_fraction * kAtmosphere) / (1.0 - 1.0 / p_.polytropic);
  }
  r.modulus = -r.volume / slope;
  return r;
}

Oil::Properties Oil::at(double pressure) const {
  const double absolute = pressure + kAtmosphere;
  if (absolute >= kFloor) return mixture(absolute);
  const double below = absolute - kFloor;
  Properties r{};
  r.volume = floor_.volume + floor_slope_ * below;
  r.modulus = -r.volume / floor_slope_;
  r.flow_work = floor_.flow_work + below * (floor_.volume + 0.5 * floor_slope_ * below);
  return r;
}

double Oil::relative_viscosity(double temperature) const {
  const double viscosity =
      std::pow(10.0, std::pow(10.0, walther_a_ - walther_b_ * std::log10(temperature + kKelvin))) -
      viscosity_offset_;
  return 1e-6 * viscosity / p_.viscosity_40;
}

}  // namespace sparflow::plant
