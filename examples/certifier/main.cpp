// A certifier with the equations of one robot compiled in: forereach-certifier in the fastest form. Make the header
// with
//   forereach export-model robot.yaml --out robot_model.h --name robot
#include "certifier/process/certifier_process.h"
#include "forereach/dynamics/compiled_models.h"
#include "robot_model.h"

int main(int argc, char** argv) {
  forereach::UseCompiled<Robot>();
  return forereach::CertifierProcess(argc, argv);
}
