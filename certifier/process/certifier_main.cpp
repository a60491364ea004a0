#include "certifier/process/certifier_process.h"

int main(int argc, char** argv) { return forereach::CertifierProcess(argc, argv); }
