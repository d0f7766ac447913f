"""Blocks in a user's SDF and URDF: nothing else changes, and removal restores the file."""

from xml.etree import ElementTree

import pytest

import hydrodamp as hd
from hydrodamp.errors import FileError, MethodError
from hydrodamp.export.gazebo import GzSim
from hydrodamp.export.insertion import find_link, insert_blocks, remove_blocks
from hydrodamp.export.plant import ExportedPlant

from .conftest import coefficients, write_export

LINK = "<link name='{}'>\n  <inertial><mass>46</mass>\n\t</inertial><!-- ü --></link>"
SDF = f"""<?xml version='1.0'?>
<sdf version="1.10"><world name="sea"><model name="rov">
  {LINK.format("hull")}
  {LINK.format("arm")}
    </model><model name="buoy">{LINK.format("hull")}</model>
</world></sdf>
"""
URDF = '<robot name="rov">\n  <link name="hull"/>\n</robot>\n'


@pytest.fixture
def blocks(tmp_path):
    """Return a folder with blocks of a vehicle with a propeller and fins."""
    plant = ExportedPlant.of(hd.fleet["vt690"], coefficients(hd.catalog["fossen"]))

    def write(**settings):
        return write_export(GzSim(link="hull", **settings), plant, tmp_path / "export")

    return write


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_all_else_of_an_sdf_remains(blocks, tmp_path, newline, encoding):
    path, link = tmp_path / "own.sdf", tmp_path / "linked.sdf"
    original = SDF.replace("\n", newline).encode(encoding)
    path.write_bytes(original)
    path.chmod(0o640)
    link.symlink_to(path)
    insert_blocks(link, "rov::hull", blocks())
    inserted = path.read_bytes()
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640
    assert (inserted.count(b"\r\n") == inserted.count(b"\n")) == (newline == "\r\n")
    rov, buoy = ElementTree.fromstring(inserted)[0]
    assert rov.find("link/inertial/fluid_added_mass/xx") is not None
    assert rov.findtext("plugin/link_name") == "hull"
    assert [joint.findtext("parent") for joint in rov.iter("joint")] == ["hull"] * 3
    assert [child.tag for child in buoy] == ["link"]
    insert_blocks(path, "rov::hull", blocks())
    assert path.read_bytes() == inserted
    insert_blocks(path, "rov::arm", blocks(density=1025.0))
    assert path.read_bytes().count(b"hydrodamp begin") == 2
    remove_blocks(path)
    assert path.read_bytes() == original


def test_a_urdf_has_no_added_mass_of_its_own(blocks, tmp_path, refused):
    path = tmp_path / "own.urdf"
    path.write_text(URDF, "utf-8")
    refused(MethodError, lambda: insert_blocks(path, "hull", blocks()))
    assert path.read_text("utf-8") == URDF
    folder = blocks()
    (folder / "added_mass.txt").write_text("", "utf-8")  # as with `legacy`
    insert_blocks(path, "hull", folder)
    robot = ElementTree.parse(path).getroot()
    children = [joint.find("child").get("link") for joint in robot.iter("joint")]
    assert children == [link.get("name") for link in robot.iter("link")][1:]
    assert len([*robot.iterfind("gazebo/plugin")]) == 1 + 2 + 2 + 1
    remove_blocks(path)
    assert path.read_text("utf-8") == URDF


def test_what_cannot_be_extended_is_refused_and_unchanged(blocks, tmp_path, refused):
    path, folder = tmp_path / "own.sdf", blocks()
    cases = (
        (SDF, "", MethodError),
        (SDF, "hull", MethodError),
        (SDF, "hul", MethodError),
        (SDF[:-9], "arm", FileError),
        (SDF.replace("inertial", "inert"), "arm", FileError),
        (SDF.replace("</link>", "<fluid_added_mass/></link>"), "arm", FileError),
        ("<sdf/>", "", MethodError),
    )
    for text, name, error in cases:
        path.write_text(text, "utf-8")
        refused(error, insert_blocks, path, name, folder)
        assert path.read_text("utf-8") == text
    path.write_bytes(SDF.encode("utf-16"))
    refused(FileError, insert_blocks, path, "arm", folder)
    path.write_text(SDF, "utf-8")
    assert find_link(path, "arm") == "rov::arm"
    refused(FileError, remove_blocks, tmp_path / "none.sdf")
