/// Cylinder forces that hold a machine in the middle of its range. hold_load MACHINE.yaml PAYLOAD_KG
#include <cstdio>
#include <cstdlib>

#include "models/files/machine_file.h"
#include "models/machine/static_force.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const sparflow::Machine machine = sparflow::load_machine(argv[1]);
  Eigen::VectorXd q(machine.joint_count());
  for (int j = 0; j < machine.joint_count(); ++j) {
    const sparflow::Range& range = machine.joints[static_cast<std::size_t>(j)].position;
    q[j] = 0.5 * (range.lo + range.hi);
  }
  const Eigen::VectorXd force = sparflow::static_force<double>(machine, q, std::atof(argv[2]));
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    std::printf("%-12s %.3f kN\n", machine.cylinders[static_cast<std::size_t>(i)].name.c_str(),
                force[i] / 1e3);
  }
  return 0;
}
