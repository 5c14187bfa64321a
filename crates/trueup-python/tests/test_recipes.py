"""The recipes for clusters: what validates them takes them, and what they run does what it is to do."""

import os
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import pytest
from conftest import Array
from PIL import Image

RECIPES = Path(__file__).parents[3] / "docs" / "recipes"
SCRIPTS = sysconfig.get_path("scripts")


@pytest.fixture
def archive(tmp_path: Path, pictures: list[Array]) -> Path:
    """A desk with two folders of photographs, and room for what is made of them."""
    for name in ("a", "b"):
        (tmp_path / "archive" / name).mkdir(parents=True)
        for number, picture in enumerate(pictures[:2]):
            Image.fromarray(picture).save(tmp_path / "archive" / name / f"{number}.jpg", quality=95)
    return tmp_path


def made(desk: Path) -> list[str]:
    return sorted(file.parent.name for file in (desk / "panoramas").glob("*/panorama.jpg"))


def run(command: list[str], **more: str) -> int:
    environment = {**os.environ, "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}", **more}
    return subprocess.run(command, env=environment).returncode


@pytest.mark.skipif(shutil.which("bash") is None, reason="it is a script of bash")
def test_tasks_of_a_slurm_array_share_the_sets(archive: Path) -> None:
    script = RECIPES / "slurm-array.sh"
    for part in ("1", "2"):
        more = {"SLURM_CPUS_PER_TASK": "1", "SLURM_ARRAY_TASK_ID": part, "SLURM_ARRAY_TASK_COUNT": "2"}
        assert run(["bash", str(script), str(archive / "archive"), str(archive / "panoramas")], **more) == 0
        assert len(made(archive)) == int(part)
    if (checker := shutil.which("shellcheck")) is not None:
        subprocess.run([checker, "--severity", "style", script], check=True)


@pytest.mark.skipif(shutil.which("sh") is None, reason="the pods run a shell")
def test_the_kubernetes_job_is_one_and_its_pods_share_the_sets(archive: Path) -> None:
    kubernetes_validate: Any = pytest.importorskip("kubernetes_validate", reason="it is not there for this Python")
    import yaml

    job = yaml.safe_load((RECIPES / "kubernetes-job.yaml").read_text())
    kubernetes_validate.validate(job, kubernetes_validate.latest_version(), strict=True)
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate({**job, "spec": {**job["spec"], "paralelism": 8}}, kubernetes_validate.latest_version(), strict=True)
    pod = job["spec"]["template"]["spec"]
    assert job["spec"]["completions"] == 8
    shell, flag, text = pod["containers"][0]["command"]
    text = text.replace("/shared", str(archive)).replace("--threads 4", "--threads 1")
    for number, done in [(0, ["a"]), (1, ["a", "b"]), (7, ["a", "b"])]:
        assert run([shell, flag, text], JOB_COMPLETION_INDEX=str(number)) == 0
        assert made(archive) == done
    # Sets of which nothing can be made are told, and no failure of the pod.
    (archive / "archive" / "c").mkdir()
    (archive / "archive" / "c" / "0.jpg").write_bytes(b"torn")
    (archive / "archive" / "c" / "1.jpg").write_bytes(b"torn, too")
    assert run([shell, flag, text], JOB_COMPLETION_INDEX="2") == 0
    assert "c" in (archive / "panoramas" / "batch.csv").read_text()
