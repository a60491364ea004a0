"""What the documents' commands find in their folder, and which blocks of commands no test runs. For `follow`."""

_DRIVE = "forereach run --config config/drive/differential_drive.yaml --directory {} >run.json 2>run.log"

# A page's commands are about these; made before its first one.
BEFORE = {
    "docs/analysis.md": _DRIVE.format("run/log") + "; for each in new old; do mkdir $each && cp -r run/log $each; done",
    "docs/export.md": _DRIVE.format("run/log"),
    "docs/logger.md": _DRIVE.format("run/log"),
    "docs/logs.md": "for each in night robot camera; do cp tests/data/course.lcmlog $each.lcmlog; done",
    "docs/verify.md": _DRIVE.format("run/latest"),
    "docs/worlds.md": r"""forereach init --model differential_drive --out my_robot.yaml
        sed -i '/  obstacles:$/,/circle/c\  obstacles: []' my_robot.yaml
        printf 'P2 3 2 255 254 254 0 254 254 254\n' >map.pgm
        printf '%s\n' 'image: map.pgm' 'resolution: 0.5' 'origin: [2, 2, 0]' 'negate: 0' 'occupied_thresh: 0.65' 'free_thresh: 0.196' >map.yaml""",
}

# Pages that a test of their own follows: it waits for processes, or needs Python.
ALONE = {"docs/tutorial.md", "examples/python/README.md"}

# The block of a page that has this line, and why it is not run.
NOT_RUN = {
    ("README.md", "scripts/demo"): "installs packages and builds; CI begins with them",
    ("README.md", "forereach doctor"): "processes that run until they are stopped; the tutorial's drive.sh runs them",
    ("README.md", "forereach live --config my_robot.yaml --key keys/verify.pub"): "a server; tests/live",
    ("docs/expressions.md", "build/robot-certifier --config robot.yaml --key keys"): "compiles; tests/install/run",
    ("docs/fleet.md", "forereach ingest run/log --database postgresql://fleet.example/forereach --robot r1"): "a server; tests/fleet",
    ("docs/fleet.md", "forereach import --config task.yaml --database postgresql://fleet.example/forereach --out fleet.csv"):
        "a server; tests/fleet",
    ("docs/live.md", "forereach live --config config/demo.yaml --key keys/verify.pub"): "a server; tests/live",
    ("docs/logs.md", "forereach tail --config config/demo.yaml"): "runs until it is stopped; tests/process/tail_test.cpp",
    ("examples/mower/README.md", "forereach keygen --robot mower keys"): "four terminals; tests/python/bus_test.py",
    ("examples/python/README.md", "forereach keygen --robot rover keys"): "four terminals; tests/python/bus_test.py",
    ("research/higher-order-car.md", "research/run drift"): "research",
    ("research/higher-order-car.md", "research/run drift --drive"): "research",
    ("research/affine.md", "research/run affine"): "research",
    ("research/regions.md", "research/run regional"): "research",
    ("research/real-car.md", "research/run real --data FOLDER --other FOLDER/car_1_Datarecording_09_16_2024_10_12_05.csv"): "research",
}
