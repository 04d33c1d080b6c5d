/// Hidden effects: sensors.
#include <algorithm>
#include <cmath>
#include <functional>

#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

class PressureOffset final : public HiddenLaw {
 public:
  explicit PressureOffset(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        side_a_(c.random->chance(0.5)),
        offset_(c.random->sign() * c.size * c.draw(2.5, 5.0) * kBar) {
    if (!side_a_)
      offset_ =
          std::abs(offset_);  // A rod side near tank pressure cannot read a negative pressure.
  }
  void sensors(const PlantState&, SensorState& sensors) override {
    double& p = side_a_ ? sensors.pressure_a[at_] : sensors.pressure_b[at_];
    // Law 1: with a gain error of a thousandth.
    p += offset_ + (law_ == 1 ? 1e-3 * p : 0.0);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"offset", offset_, "Pa", offset_},
            {"chamber", side_a_ ? 1.0 : -1.0, "-", side_a_ ? 1.0 : -1.0}};
  }

 private:
  std::size_t at_;
  int law_;
  bool side_a_;
  double offset_;
};

class SensorDelay final : public HiddenLaw {
 public:
  explicit SensorDelay(LawContext& c)
      : law_(c.law),
        joints_(c.machine->joint_count()),
        pick_(std::min(joints_ - 1, static_cast<int>(c.random->unit() * joints_))),
        delay_(c.size * c.draw(0.08, 0.2)) {}
  void recording(Recording& r, Random&) override {
    if (law_ == 0) {
      for (auto& q : r.q) late(q, r.rate);
    } else if (law_ == 1) {
      for (auto* group : {&r.pressure_a, &r.pressure_b, &r.pump})
        for (auto& p : *group) late(p, r.rate);
    } else {
      late(r.q[static_cast<std::size_t>(pick_)], r.rate);
    }
  }
  std::vector<HiddenParameter> parameters() const override {
    const double late = law_ == 0 ? 1.0 : law_ == 1 ? -1.0 : 2.0 + pick_;
    return {{"delay", delay_, "s", delay_}, {"late", late, "-", late}};
  }

 private:
  void late(std::vector<double>& values, double rate) const {
    const std::vector<double> before = values;
    const double shift = delay_ * rate;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double x = std::max(0.0, static_cast<double>(i) - shift);
      const auto k = static_cast<std::size_t>(x);
      const double f = x - static_cast<double>(k);
      values[i] = before[k] * (1.0 - f) + before[std::min(k + 1, before.size() - 1)] * f;
    }
  }
  int law_, joints_, pick_;
  double delay_;
};

class SensorFault final : public HiddenLaw {
 public:
  explicit SensorFault(LawContext& c)
      : machine_(c.machine),
        channel_(c.channel),
        law_(c.law),
        size_(c.size),
        seed_(c.random->next()) {}
  void recording(Recording& r, Random&) override {
    std::vector<double>* noise = nullptr;
    std::vector<double>* values = find(r, noise);
    if (!values) return;
    Random random(seed_, "fault");
    double square = 0.0;
    for (const double v : *noise) square += v * v;
    const double level =
        std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, noise->size())));
    const auto n = values->size();
    if (law_ == 0) {  // Noise far above that of the channel.
      for (double& v : *noise) v *= 1.0 + 9.0 * size_;
    } else if (law_ == 1) {  // Stuck for seconds, several times.
      const int times = std::max(2, static_cast<int>(static_cast<double>(n) / r.rate / 40.0));
      for (int k = 0; k < times; ++k) {
        const auto from = static_cast<std::size_t>(random.unit() * static_cast<double>(n));
        const auto length = static_cast<std::size_t>(random.uniform(4.0, 12.0) * size_ * r.rate);
        const double held = (*values)[from] + (*noise)[from];
        for (std::size_t i = from; i < std::min(n, from + length); ++i) {
          (*values)[i] = held;
          (*noise)[i] = 0.0;
        }
      }
    } else {  // Jumps: one sample in fifty is far off.
      for (std::size_t i = 0; i < n; ++i) {
        if (random.chance(0.02))
          (*noise)[i] += random.sign() * random.uniform(20.0, 60.0) * level * size_;
      }
    }
  }
  std::vector<HiddenParameter> parameters() const override { return {}; }

 private:
  std::vector<double>* find(Recording& r, std::vector<double>*& noise) const {
    const auto pick = [&](auto& group, auto& noises, std::size_t i) {
      noise = &noises[i];
      return &group[i];
    };
    for (std::size_t i = 0; i < machine_->cylinders.size(); ++i) {
      if (channel_ == "pA_" + machine_->cylinders[i].name) return pick(r.pressure_a, r.noise_a, i);
      if (channel_ == "pB_" + machine_->cylinders[i].name) return pick(r.pressure_b, r.noise_b, i);
    }
    for (std::size_t p = 0; p < machine_->pumps.size(); ++p)
      if (channel_ == "p_" + machine_->pumps[p].name) return pick(r.pump, r.noise_pump, p);
    for (std::size_t k = 0; k < machine_->joints.size(); ++k)
      if (channel_ == "q_" + machine_->joints[k].name) return pick(r.q, r.noise_q, k);
    return nullptr;
  }
  const Machine* machine_;
  std::string channel_;
  int law_;
  double size_;
  std::uint64_t seed_;
};

}  // namespace

std::vector<LawEntry> sensor_laws() {
  return {
      {"pressure_offset",
       HiddenPlace::kCylinder,
       true,
       {"constant", "with a gain error of 0.1 %"},
       "offset [Pa] added to the reading of chamber 1 (A) or -1 (B)",
       make_law<PressureOffset>,
       hydraulic},
      {"sensor_delay",
       HiddenPlace::kMachine,
       true,
       {"all positions late", "all pressures late", "one position late"},
       "delay [s]; late 1: positions, -1: pressures, 2, 3 ...: that of the first, second ... joint",
       make_law<SensorDelay>},
      {"sensor_fault",
       HiddenPlace::kChannel,
       true,
       {"noise ten times", "stuck for seconds", "single samples far off"},
       "none",
       make_law<SensorFault>}};
}

}  // namespace sparflow::simulator
