"""Processes of a batch: they listen to this machine alone; a scheduler under TLS is reached with certificates only."""

import shutil
import signal
import subprocess
from pathlib import Path

import psutil
import pytest
from distributed import Client

from scruton.errors import InputError
from scruton.terminal import Terminated, terminating
from scruton.workers import TlsFiles, connected


def listening() -> set[str]:
    """Addresses that this process and those below it listen at."""
    own = psutil.Process()
    return {
        one.laddr.ip
        for process in (own, *own.children(recursive=True))
        for one in process.net_connections("inet")
        if one.status == psutil.CONN_LISTEN
    }


def test_the_processes_of_a_batch_listen_to_this_machine_alone() -> None:
    before = listening()
    with connected(None, 2, quiet=True) as client:
        assert len(client.nthreads()) == 2
        during = listening() - before
    assert during
    assert during <= {"127.0.0.1", "::1"}


def test_what_ends_a_command_waits_until_its_processes_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else Dask's client is half made, and complains when it goes."""

    class Disturbed(Client):  # type: ignore[misc]
        def __init__(self, *arguments: object) -> None:
            signal.raise_signal(signal.SIGTERM)
            super().__init__(*arguments)
            made.append(self)

    made: list[Client] = []
    monkeypatch.setattr("distributed.Client", Disturbed)
    with terminating(), pytest.raises(Terminated), connected(None, 1, quiet=True):
        pytest.fail("the block began")
    assert [client.status for client in made] == ["closed"]


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> TlsFiles:
    """A certificate that is its own authority."""
    if shutil.which("openssl") is None:
        pytest.skip("no openssl to make a certificate with")
    folder = tmp_path_factory.mktemp("tls")
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"]
    subprocess.run([*command, "-keyout", "key.pem", "-out", "cert.pem"], cwd=folder, check=True, capture_output=True)
    return folder / "cert.pem", folder / "cert.pem", folder / "key.pem"


def test_a_scheduler_under_tls_is_reached_with_certificates_only(
    certificate: TlsFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import LocalCluster, Security

    monkeypatch.setattr("scruton.workers.REACH", 2)
    authority, own, key = map(str, certificate)
    parts = {f"tls_{one}_{kind}": name for one in ("scheduler", "worker", "client")
             for kind, name in (("cert", own), ("key", key))}  # fmt: skip
    cluster = LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tls://", host="127.0.0.1",
        dashboard_address="127.0.0.1:0", security=Security(tls_ca_file=authority, require_encryption=True, **parts),
    )  # fmt: skip
    with cluster:
        address = cluster.scheduler_address
        assert address.startswith("tls://")
        with connected(address, 1, tls=certificate) as client:
            assert client.submit(abs, -3).result() == 3
        with pytest.raises(InputError, match="--scheduler"), connected(address, 1):
            pass


@pytest.mark.parametrize(
    ("scheduler", "given", "message"),
    [
        (None, "abc", "--tls-ca: found no --scheduler"),
        ("tcp://127.0.0.1:1", "abc", r"--tls-ca: found tcp://127\.0\.0\.1:1; wanted a scheduler under TLS"),
        ("tls://127.0.0.1:1", "ab", "--tls-key: found nothing; wanted all three"),
        ("tls://127.0.0.1:1", "xyz", "x: found no such file"),
        ("tls://127.0.0.1:1", "abc", "--tls-ca: found certificates that cannot be used"),
    ],
)
def test_tls_that_cannot_be(tmp_path: Path, scheduler: str | None, given: str, message: str) -> None:
    for name in "abc":
        (tmp_path / name).write_text("no certificate", encoding="utf-8")
    ca, cert, key, *_ = [*(tmp_path / name for name in given), None]
    with pytest.raises(InputError, match=message), connected(scheduler, 1, tls=(ca, cert, key)):
        pass
