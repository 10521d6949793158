"""The controller for ros2_control, compiled against stand-ins for ROS and run in a loop."""

import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.app.deployment.conftest import built  # noqa: F401  a fixture

import ftqp
from ftqp.app.deployment.headers import arm_file, arm_header

yaml = pytest.importorskip("yaml", reason='needs PyYAML (pip install -e ".[docs]")')
FOLDER = Path(__file__).parents[2] / "integrations" / "ros2_control"
STRICT = ("-std=c++17", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O0")
CHECKED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


@pytest.fixture(scope="module")
def panda(built, tmp_path_factory):  # noqa: F811
    """A folder with a Panda's file and header."""
    folder = tmp_path_factory.mktemp("panda")
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(radius=0.05, place=(0.0, 9.0, 0.0)))
    clear = ftqp.Clearance(self_pairs=False)
    planner = ftqp.Planner(ftqp.robots.load("panda"), scene=scene, clearance=clear)
    file = arm_file(planner.deployable(), 7)
    (folder / "arm.ftqp").write_bytes(file)
    (folder / "arm.h").write_text(arm_header(planner, "panda", file, embedded=False))
    return folder


@pytest.mark.slow
def test_the_controller_follows_loses_a_joint_stops_and_keeps_every_limit(built, panda):  # noqa: F811
    program = panda / "in_a_loop"
    headers = [built / "include", panda, FOLDER / "include", FOLDER / "stand_in"]
    sources = [
        FOLDER / "src" / "ftqp_controller.cpp",
        FOLDER / "test" / "in_a_loop.cpp",
        built / "lib" / "libftqp.a",
    ]
    subprocess.run(
        ["g++", *STRICT, *CHECKED, *(f"-I{header}" for header in headers), *sources, "-lm", "-o", program],
        check=True,
    )  # fmt: skip
    done = subprocess.run([program, panda / "arm.ftqp"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "NO " not in done.stdout, done.stdout + done.stderr
    assert len(re.findall("^yes", done.stdout, re.M)) >= 27


def test_parameters_of_the_stand_in_are_those_of_the_file():
    """What generate_parameter_library would make has the names, kinds and defaults of the YAML file."""
    said = yaml.safe_load((FOLDER / "src" / "ftqp_controller_parameters.yaml").read_text())["ftqp_controller"]
    header = (FOLDER / "stand_in" / "ftqp_controller" / "ftqp_controller_parameters.hpp").read_text()
    body = header.split("struct Params {")[1].split("};")[0]
    numbers = dict(re.findall(r"(\w+) = ([\d.]+)", body))
    for name, one in said.items():
        assert one["description"]
        if one["type"] == "double":
            assert float(numbers.pop(name)) == one["default_value"], name
        else:
            assert re.search(rf"\b{name}\b", body), name
    assert not numbers


def test_the_plugin_is_described_as_the_source_exports_it():
    found = ElementTree.parse(FOLDER / "ftqp_controller.xml").find("class").attrib
    source = (FOLDER / "src" / "ftqp_controller.cpp").read_text()
    assert f"PLUGINLIB_EXPORT_CLASS({found['type']}, {found['base_class_type']})" in source
    listed = {tag.text for tag in ElementTree.parse(FOLDER / "package.xml").findall("depend")}
    needed = set(
        re.findall(
            r"\w+_(?:msgs|interface|tools|lifecycle|library)|rclcpp|pluginlib",
            (FOLDER / "CMakeLists.txt").read_text(),
        )
    )
    assert listed - needed == set()


def test_example_parameters_are_known():
    given = yaml.safe_load((FOLDER / "config" / "panda.yaml").read_text())["ftqp"]["ros__parameters"]
    said = yaml.safe_load((FOLDER / "src" / "ftqp_controller_parameters.yaml").read_text())["ftqp_controller"]
    assert set(given) <= set(said)
    assert given["joints"] == list(ftqp.robots.load("panda").joints)
