"""The command line: the only file that knows all three packages, and the one that turns errors into exit codes."""

from __future__ import annotations

import io
import os
import re
import signal
import sys
import warnings
from collections import Counter, deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice, pairwise
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from reference.device import DEVICES, PRECISIONS
from reference.errors import CrossrayError, FailureError, InputError, SceneWarning, plain
from reference.scene import LARGEST_DEPTH, LARGEST_SIDE, Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from translator.contract import Settings
    from translator.run import Outcome

DONE, DISAGREES, BAD_INPUT, NOT_DONE, SIGNALLED = 0, 1, 2, 3, 128
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SHOWN_WARNINGS = 20
QUICK = 1 << 22  # pixels that need no progress bar
TIMED_RUNS = 5
SHORTEST_PROOF = 600.0  # seconds that proving a picture may take, whatever renderers may
EMPTY = Scene((255.0, 255.0, 255.0), 0.1)


@dataclass(frozen=True)
class Size:
    """Width and height in pixels, as in 1000x1000."""

    width: int
    height: int

    @staticmethod
    def parse(text: object) -> Size:
        """From a word on the command line, or a default."""
        match = re.fullmatch(r"([0-9]{1,6})[xX]([0-9]{1,6})", str(text))
        if not match or not all(1 <= int(side) <= LARGEST_SIDE for side in match.groups()):
            raise click.BadParameter(f"expected a size like 1000x1000, at most {LARGEST_SIDE} a side, found {text!r}")
        return Size(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


class NamesCommand(click.Command):
    """Lets `--with` and `--to` take several renderers at once: the names that follow them."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each further name."""
        from translator.registry import renderer_names

        known = set(renderer_names())
        spread: list[str] = []
        option = None
        for word in args:
            if option and spread[-1] != option and known.issuperset(word.split(",")):
                spread.append(option)
            elif word in ("--with", "--to"):
                option = word
            elif not (option and spread[-1] == option):
                option = None
            spread.append(word)
        return super().parse_args(ctx, spread)


def _split(names: Sequence[str]) -> list[str]:
    """Names that may come joined by commas, each once."""
    return list(dict.fromkeys(name for joined in names for name in joined.split(",")))


PATH = click.Path(path_type=Path)
CONVENTIONS = click.Choice(["document", "published", "exact"])  # the readings of the assignment
scene_argument = click.argument("scene", metavar="SCENE", help="A scene file, or - for standard input.")
size_option = click.option(
    "--size", type=Size.parse, default="1000x1000", metavar="WxH", help="Pixels across and down."
)
depth_option = click.option(
    "--depth", type=click.IntRange(0, LARGEST_DEPTH), default=3, help="Bounces after the primary hit."
)
quiet_option = click.option("--quiet", "-q", is_flag=True, help="Say nothing but results and errors.")
verbose_option = click.option("--verbose", "-v", is_flag=True, help="Say more about what is being done.")
json_option = click.option("--json", "as_json", is_flag=True, help="The same for programs.")


def _show_version(_context: click.Context, _option: click.Parameter, wanted: bool) -> None:
    if wanted:
        print(f"crossray {_version()}")
        raise click.exceptions.Exit


@click.group(context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.option(
    "--version", is_flag=True, callback=_show_version, is_eager=True, expose_value=False, help="Print the version."
)
def app() -> None:
    """Draw the ray tracing assignment's scenes, here and in other renderers, and compare the pictures.

    \b
    crossray render scenes/example1.txt
    crossray check homework.txt --out out/homework
    """


@app.command()
@scene_argument
@click.option("--output", "-o", type=PATH, default=Path("scene.jpg"), help="JPEG, PNG or EXR.")
@size_option
@depth_option
@click.option("--convention", type=CONVENTIONS, default="document", help="Which reading of the assignment.")
@click.option("--precision", type=click.Choice(PRECISIONS), default="auto", help="Of the computation; auto: as double.")
@click.option("--device", type=click.Choice(DEVICES), default="auto", help="Where to compute.")
@click.option("--show", is_flag=True, help="Show the picture in a window.")
@click.option("--time", is_flag=True, help="Trace a few times more and print how long that takes.")
@quiet_option
@verbose_option
def render(
    scene: str,
    output: Path,
    size: Size,
    depth: int,
    convention: str,
    precision: str,
    device: str,
    show: bool,
    time: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Draw one scene.

    \b
    crossray render scenes/example1.txt
    crossray render scenes/example1.txt -o picture.exr --size 500x500 --convention exact
    """
    from reference.image import check_format, show_window, write_bands

    check_format(output)
    loaded = _load(scene, quiet)
    import reference

    model = reference.CONVENTIONS[convention]
    from reference.tracer import render_bands

    asked: dict[str, Any] = {"width": size.width, "height": size.height, "depth": depth}
    asked |= {"precision": precision, "device": device}
    trace = partial(render_bands, loaded, model, **asked)
    with closing(_watched(trace(), size, quiet)) as bands:
        write_bands(output, size.width, size.height, bands)
    _say(f"{output}: {size}, {convention}, {precision} precision", quiet or not verbose)
    if time:
        from statistics import median

        runs = [perf_counter()]
        for _ in range(TIMED_RUNS):
            deque(trace(), maxlen=0)
            runs.append(perf_counter())
        seconds = median(after - before for before, after in pairwise(runs))
        print(f"traced in {seconds:.4f} s, the median of {TIMED_RUNS} without start-up and files", file=sys.stderr)
    if show:
        show_window(reference.render(loaded, model, **asked, dtype=float))


def _watched(bands: Iterator[NDArray[Any]], size: Size, quiet: bool) -> Generator[NDArray[Any]]:
    """The bands of a picture; for a large one, how many rows are done stands on the terminal meanwhile."""
    if size.width * size.height <= QUICK or quiet or not sys.stderr.isatty():
        yield from bands
        return
    from reports.terminal import progress_lines

    with progress_lines(quiet, False, {"rows": size.height}) as show:
        for band in bands:
            yield band
            show("rows", "", len(band))


@app.command(cls=NamesCommand)
@scene_argument
@click.option("--output", "-o", type=PATH, default=Path("export"), help="A folder; each renderer gets one in it.")
@click.option("--to", multiple=True, metavar="RENDERER ...", help="Default: all.")
@size_option
@depth_option
@quiet_option
@verbose_option
def export(scene: str, output: Path, to: Sequence[str], size: Size, depth: int, quiet: bool, verbose: bool) -> None:
    """Write a ready-to-run scene for other renderers and print the line that runs each.

    \b
    crossray export scenes/example1.txt -o export --to povray mitsuba
    """
    import shlex

    from reference.errors import RendererError
    from translator.contract import Unsupported
    from translator.registry import check_names, renderer_names
    from translator.run import command_line, export_scene, write_export

    check_names(_split(to))
    loaded, settings = _load(scene, quiet), _settings(size, depth)
    names = _split(to) or renderer_names()[1:]
    refused = 0
    for name in names:
        try:
            exported = export_scene(name, loaded, settings)
        except (Unsupported, RendererError) as reason:
            refused += 1
            print(f"{name}: not exported: {reason}", file=sys.stderr)
            continue
        folder = output / name
        write_export(exported, folder)
        place = str(folder) if folder.is_absolute() else f"./{folder}"  # CDPATH cannot lead elsewhere
        _print(f"(cd -- {shlex.quote(place)} && {command_line(exported)})")
        for note in exported.notes if verbose else ():
            print(f"{name}: {note}", file=sys.stderr)
    if refused and refused == len(names):
        raise FailureError("no renderer can carry this scene")


@app.command(cls=NamesCommand)
@click.argument("scenes", nargs=-1, metavar="[SCENE]...", help="Scene files; default: the four examples.")
@click.option("--out", type=PATH, default=Path("out"), help="The folder for the report and the pictures.")
@click.option("--with", "renderers", multiple=True, metavar="RENDERER ...", help="Default: all that there are.")
@size_option
@depth_option
@click.option("--timeout", type=click.FloatRange(min=1), default=600.0, help="Seconds that a renderer may take.")
@click.option("--terms", "by_term", is_flag=True, help="Compare ambient, direct and mirrored light one by one, too.")
@click.option("--baseline", type=PATH, metavar="DIR", help="Compare the native pictures with those of an earlier run.")
@quiet_option
@verbose_option
def check(
    scenes: Sequence[str],
    out: Path,
    renderers: Sequence[str],
    size: Size,
    depth: int,
    timeout: float,
    by_term: bool,
    baseline: Path | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Draw scenes in every renderer, compare the pictures with the certified truth, and write a report.

    \b
    crossray check
    crossray check homework.txt --with povray --out out/homework
    crossray check --baseline out/before --out out/after
    """
    from reference.text import dump
    from reports.approvals import approvals_path, read_approvals
    from reports.baseline import read_baseline
    from reports.history import remember
    from reports.recording import Recording
    from reports.terminal import progress_lines, summary_lines
    from reports.terms import VARIED, record_comparisons, record_terms, variants
    from reports.writing import write_reports
    from translator.concurrency import Job, run_jobs
    from translator.process import run_process
    from translator.registry import TRUTH, check_names, renderer_names

    required = _split(renderers)
    names = required or renderer_names()
    check_names(names)
    loaded = [(path, _load(path, quiet)) for path in scenes or _examples()]
    settings = _settings(size, depth)
    limits = {name: max(timeout, SHORTEST_PROOF) if name == TRUTH else timeout for name in (TRUTH, *names)}
    texts = [(path, dump(scene)) for path, scene in loaded]
    approved = [read_approvals(approvals_path(path)) if path != "-" else [] for path, _ in loaded]
    earlier = read_baseline(baseline, texts, size.width, size.height, depth) if baseline else [None] * len(loaded)
    jobs = []
    for path, scene in loaded:
        jobs += [Job(name, path, scene, settings, limit) for name, limit in limits.items()]
        for term, variant in variants(scene).items() if by_term else ():
            jobs += [Job(name, f"{path}, {term} alone", variant, settings, timeout) for name in names]
    steps = Counter(job.renderer for job in jobs) | {"comparing": len(loaded) * (len(names) + bool(baseline))}
    run = Recording(out, _version())
    with progress_lines(quiet, verbose, steps) as show:

        def report(job: Job, outcome: Outcome | None) -> None:
            what = f"{job.title}: {_ending(outcome)}" if outcome else job.title
            show(job.renderer, what, 1 if outcome else 0)

        with closing(run_jobs(jobs, report)) as outcomes:
            for (path, text), accepted, before in zip(texts, approved, earlier, strict=True):
                facts = {"depth": depth, "convention": "exact", "text": text, "approvals": accepted}
                entry = run.add_scene(path, size.width, size.height, **facts)
                full = {}
                for outcome in islice(outcomes, len(limits)):
                    full[outcome.renderer] = outcome.picture
                    run.add_picture(entry, {k: v for k, v in vars(outcome).items() if k != "picture"}, outcome.picture)
                if before:
                    run.add_picture(entry, *before)
                terms = record_terms(run, entry, lambda words, place: run_process(words, place, {}, timeout))
                if by_term:
                    alone = [{job.renderer: job for job in islice(outcomes, len(names))} for _ in VARIED]
                    for name in names:
                        pictures = {term: by_name[name].picture for term, by_name in zip(VARIED, alone, strict=True)}
                        about = (name, alone[0][name].title)
                        record_comparisons(run, entry, terms, about, full[name], pictures)
        results = write_reports(out, lambda text: show("comparing", text, 1))
        remember(out, results)
    _print("\n".join(summary_lines(results)))
    _say(f"{out / 'report.html'}", quiet)
    raise click.exceptions.Exit(_exit_code(results, required))


@app.command()
@scene_argument
@click.argument("renderer", metavar="RENDERER")
@click.option("--because", required=True, metavar="TEXT", help="Why the difference is accepted.")
@click.option("--until", required=True, metavar="YYYY-MM-DD", help="The last day on which it is.")
@click.option("--out", type=PATH, default=Path("out"), help="The folder of the run that has the difference.")
@quiet_option
@verbose_option
def approve(scene: str, renderer: str, because: str, until: str, out: Path, quiet: bool, verbose: bool) -> None:
    """Accept the pixels of a renderer that a check found unexplained, in a file beside the scene.

    \b
    crossray approve homework.txt povray --because "known, issue 12" --until 2027-01-31
    """
    from datetime import date

    from reference.text import dump
    from reports.approvals import approvals_path, approve, read_approvals
    from reports.recording import find_picture, read_run, write_run
    from reports.results import read_levels, unexplained
    from reports.writing import write_reports

    try:
        last = date.fromisoformat(until)
    except ValueError as error:
        raise click.BadParameter(f"expected a day like 2027-01-31, found {until!r}", param_hint="--until") from error
    if last < date.today():
        raise click.BadParameter(f"expected a day that is not over, found {until}", param_hint="--until")
    path = approvals_path(scene)
    run = read_run(out)
    entry, picture = find_picture(out, run, dump(_load(scene, quiet)), renderer)
    places = unexplained(out, entry, picture)
    number = approve(path, entry, renderer, read_levels(out, picture), places, because=because, until=last)
    entry["approvals"] = read_approvals(path)
    write_run(out, run)
    write_reports(out)
    _print(f"{path}: {number} pixels of {renderer} approved until {last}")
    _say(f"{out / 'report.html'}", quiet)


@app.command()
@click.argument("a", type=PATH, help="The picture that is right.")
@click.argument("b", type=PATH, help="The picture to compare with it.")
@click.option("--out", type=PATH, help="A folder for a report.")
@quiet_option
@verbose_option
def compare(a: Path, b: Path, out: Path | None, quiet: bool, verbose: bool) -> None:
    """Compare two pictures of the same size.

    \b
    crossray compare right.png mine.png --out out/mine
    """
    from reference.image import read_image
    from reports.metrics import measure
    from reports.recording import Recording
    from reports.writing import write_reports

    right, other = read_image(a), read_image(b)
    if right.shape != other.shape:
        sizes = [f"{picture.shape[1]}x{picture.shape[0]}" for picture in (right, other)]
        raise InputError(f"{b}:1:1: expected a picture of {sizes[0]} like {a}, found {sizes[1]}")
    measured = measure(right, other)
    _print(measured.as_text())
    if out:
        run = Recording(out, _version())
        entry = run.add_scene(str(b), right.shape[1], right.shape[0], depth=None, convention=None, text=None)
        for renderer, path, levels in (("reference", a, right), ("picture", b, other)):
            run.add_picture(entry, run.picture_file(renderer, path), levels)
        write_reports(out)
        _say(f"{out / 'report.html'}", quiet)
    raise click.exceptions.Exit(DISAGREES if measured.over["0.5"] else DONE)


@app.command()
@click.argument("paths", nargs=-1, required=True, type=PATH, metavar="[SCENE] PICTURE ...", help="Files or folders.")
@click.option("--scene", "scenes", multiple=True, help="A scene file; several, for the pictures of each.")
@click.option("--out", type=PATH, default=Path("out"), help="The folder for the pages and results.")
@click.option("--pattern", help="Where pictures are in a folder, as in {student}/{scene}.jpg.")
@depth_option
@click.option("--jobs", type=click.IntRange(1), help="Pictures at a time; default: as many as there are cores.")
@click.option("--timeout", type=click.FloatRange(min=1), default=300.0, help="Seconds that a picture may take.")
@quiet_option
@verbose_option
def grade(
    paths: Sequence[Path],
    scenes: Sequence[str],
    out: Path,
    pattern: str | None,
    depth: int,
    jobs: int | None,
    timeout: float,
    quiet: bool,
    verbose: bool,
) -> None:
    """Say whether pictures are right, and if not, what probably went wrong and what to do.

    \b
    crossray grade scenes/example1.txt scene.jpg
    crossray grade --scene scenes/example1.txt --scene scenes/example2.txt submissions --out out/class
    """
    from reports.collection import collect
    from reports.gradebook import Assignment
    from reports.gradebook import grade as grade_all
    from reports.gradelines import class_lines, picture_lines
    from reports.terminal import progress_lines

    named = list(scenes) or [str(paths[0])]
    places = paths if scenes else paths[1:]
    if not places:
        raise InputError("expected SCENE PICTURE ..., or --scene SCENE and pictures or folders; found no picture")
    loaded = [_load(path, quiet) for path in named]
    names = _scene_names(named)
    found = collect(names, places, pattern)
    for path, reason in found.ignored if verbose else ():
        _say(f"left out: {path}: {reason}", quiet)
    assignment = Assignment(dict(zip(names, loaded, strict=True)), dict(zip(names, named, strict=True)), depth)
    with progress_lines(quiet, verbose, {"grading": len(found.entries)}) as show:
        results = grade_all(
            assignment,
            found,
            out,
            _version(),
            jobs=jobs,
            timeout=timeout,
            progress=lambda text: show("grading", text, 1),
        )
    several = len(results["students"]) > 1
    lines = class_lines(results) if several else (line for p in results["pictures"] for line in picture_lines(p))
    _print("\n".join(map(plain, lines)))
    _say(f"{out / 'grade.html'}", quiet)
    statuses = {picture["status"] for picture in results["pictures"]}
    wrong = any(picture["verdict"] == "wrong" for picture in results["pictures"])
    code = NOT_DONE if "failed" in statuses else BAD_INPUT if "refused" in statuses else DISAGREES if wrong else DONE
    raise click.exceptions.Exit(code)


def _scene_names(paths: Sequence[str]) -> list[str]:
    """The scenes' names: those of their files, which pictures are called by too."""
    names = [Path(path).stem if path != "-" else "stdin" for path in paths]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"expected scene files of different names, found {twice} twice")
    return names


def assert_matches(scene: str | Path, picture: str | Path, **options: Any) -> None:
    """Raise AssertionError unless `picture` is right for `scene`, naming the likely cause, what to do, and the report.

    For tests in a repository of your own. Options: `depth` (3), `out`, a folder for the report (one of the picture's
    name in `crossray-report`), and `timeout` (300 seconds). Raises SceneError for a scene that cannot be read and
    FailureError where the picture could not be graded.
    """
    from reports.assertion import check_picture

    __tracebackhide__ = True
    check_picture(scene, picture, **options)


@app.command()
@scene_argument
@click.argument("column", type=int, help="From the left, from 0.")
@click.argument("row", type=int, help="From the top, from 0.")
@size_option
@depth_option
@click.option("--convention", type=CONVENTIONS, multiple=True, help="Which reading; give two to see where they part.")
@json_option
@quiet_option
@verbose_option
def explain(
    scene: str,
    column: int,
    row: int,
    size: Size,
    depth: int,
    convention: Sequence[str],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Tell the rays behind one pixel, every term with its numbers.

    \b
    crossray explain scenes/example1.txt 500 700
    crossray explain scenes/example1.txt 500 700 --convention document --convention published
    """
    import dataclasses
    import json

    from reference.explanation import explain
    from reference.model import CONVENTIONS
    from reports.raytree import parting, ray_tree

    loaded = _load(scene, quiet)
    pixel = {"column": column, "row": row, "width": size.width, "height": size.height, "depth": depth}
    told = [explain(loaded, CONVENTIONS[name], **pixel) for name in convention or ["document"]]
    if as_json:
        conventions = [dataclasses.asdict(explanation) for explanation in told]
        _print(json.dumps({"version": 1, "scene": scene, "conventions": conventions}, indent=1, allow_nan=False))
        return
    _print("\n\n".join("\n".join(ray_tree(explanation)) for explanation in told))
    for other in told[1:]:
        _print(f"\n{parting(told[0], other)}")


@app.command()
@scene_argument
@click.option("--output", "-o", type=PATH, help="The certified picture: EXR, PNG.")
@click.option("--mask", type=PATH, help="A PNG: white is proven, grey a knife edge, black undecided.")
@size_option
@depth_option
@json_option
@quiet_option
@verbose_option
def certify(
    scene: str,
    output: Path | None,
    mask: Path | None,
    size: Size,
    depth: int,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Prove every pixel of the exact picture, and list those that no precision can decide.

    \b
    crossray certify scenes/example1.txt
    crossray certify homework.txt -o truth.exr --mask mask.png
    """
    from reference.certification import certify
    from reference.image import check_format, write_image
    from reports.certificate import as_data, as_text
    from reports.terminal import progress_lines

    for path in filter(None, (output, mask)):
        check_format(path)
    if mask and (mask.suffix.lower() != ".png" or mask == output):
        raise InputError(f"{mask}: expected another name ending in .png for the mask")
    loaded = _load(scene, quiet)
    start = perf_counter()
    with progress_lines(quiet, verbose, {"certify": 100}) as show:
        shape = {"width": size.width, "height": size.height, "depth": depth}
        certificate = certify(loaded, **shape, progress=lambda text: show("certify", text, 1))
    _say(f"certified in {perf_counter() - start:.3f} s", quiet)
    if output:
        write_image(output, certificate.picture)
    if mask:
        write_image(mask, certificate.mask[..., None].repeat(3, axis=-1).astype(float))
    if as_json:
        import json

        _print(json.dumps({"version": 1, "scene": scene, **as_data(certificate)}, indent=1, allow_nan=False))
    else:
        _print("\n".join(as_text(certificate)))


@app.command()
@quiet_option
@verbose_option
def doctor(quiet: bool, verbose: bool) -> None:
    """Say what is installed, what works, and what to do about the rest.

    \b
    crossray doctor
    """
    from reference.device import describe
    from reference.errors import RendererError
    from translator.contract import Settings, Unsupported
    from translator.registry import NATIVE, adapter, ignored_offers, renderer_names
    from translator.run import export_scene, installed_version

    parts = describe()
    healthy = all(fine for _, fine, _ in parts)
    for name, fine, text in parts:
        _print(f"{'works  ' if fine else 'BROKEN '} {name}: {text}")
    for name in renderer_names():
        try:
            renderer, version = adapter(name), installed_version(name)
            with suppress(Unsupported):
                export_scene(name, EMPTY, Settings())
        except RendererError as error:
            _print(f"BROKEN  {name}: {error}")
            continue
        if version and name == NATIVE and not healthy:
            _print(f"BROKEN  {name}: {renderer.TITLE} {version} needs what is broken above")
        elif version:
            _print(f"works   {name}: {renderer.TITLE} {version}")
        else:
            _print(f"missing {name}: {renderer.INSTALL}")
    for offer in ignored_offers():
        _print(f"ignored {offer}")
    raise click.exceptions.Exit(DONE if healthy else NOT_DONE)


def main() -> None:
    """The console script."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="surrogateescape")  # file names can be any bytes
    try:
        for number in SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:  # as nohup and shells in the background have them
                signal.signal(number, _stop)
        app()
    except _Stopped as stop:
        _fail("interrupted", SIGNALLED + stop.number)
    except InputError as error:
        _fail(str(error), BAD_INPUT)
    except CrossrayError as error:
        _fail(str(error), NOT_DONE)
    except OSError as error:
        _fail(f"{error.filename or 'the system'}: {error.strerror or error}", NOT_DONE)
    except MemoryError:
        _fail("there is not enough memory for this", NOT_DONE)
    except Exception:
        import traceback

        traceback.print_exc()
        _fail("this is a mistake in crossray, please report it", NOT_DONE)


class _Stopped(BaseException):
    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def _stop(number: int, frame: object) -> None:
    """End as on an error: what was begun is cleared away, what was finished stays. Nothing can interrupt that."""
    for other in SIGNALS:
        signal.signal(other, signal.SIG_IGN)
    raise _Stopped(number)


def _fail(message: str, code: int) -> None:
    print(plain(message), file=sys.stderr)
    sys.exit(code)


def _print(text: str) -> None:
    """Results to standard output; a reader that has gone away is no disagreement."""
    try:
        print(text, flush=True)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise FailureError(f"standard output: {error.strerror}") from error


def _load(path: str, quiet: bool) -> Scene:
    """Read a scene; warnings go to standard error."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SceneWarning)
        scene = Scene.load(path)
    for warning in caught[:SHOWN_WARNINGS]:
        _say(f"warning: {warning.message}", quiet)
    if len(caught) > SHOWN_WARNINGS:
        _say(f"warning: and {len(caught) - SHOWN_WARNINGS} more", quiet)
    return scene


def _examples() -> list[str]:
    """The document's four scenes, from the checkout or from the installed package."""
    here = Path(__file__).resolve().parent
    for folder in (here / "scenes", here / "reference" / "scenes"):
        if examples := sorted(folder.glob("example?.txt")):
            return [os.path.relpath(path) if folder == here / "scenes" else str(path) for path in examples]
    raise InputError("the example scenes are missing from this installation; name the scenes to check")


def _settings(size: Size, depth: int) -> Settings:
    from translator.contract import Settings
    from translator.process import usable_cores

    return Settings(size.width, size.height, depth, threads=len(usable_cores()))


def _exit_code(results: dict[str, Any], required: list[str]) -> int:
    """The exit code of a check; a renderer that was asked for by name is required."""
    references = [scene["reference"] for scene in results["scenes"]]
    pictures = [picture for scene in results["scenes"] for picture in scene["comparisons"]]
    missing = [
        picture for picture in pictures if picture["status"] == "not-installed" and picture["renderer"] in required
    ]
    if missing or any(picture["status"] == "failed" for picture in [*references, *pictures]):
        return NOT_DONE
    return DISAGREES if any(picture["verdict"] == "disagree" for picture in pictures) else DONE


def _ending(outcome: Outcome) -> str:
    return outcome.status + (f" in {outcome.seconds:.1f} s" if outcome.seconds else "")


def _say(text: str, quiet: bool = False) -> None:
    if not quiet:
        print(plain(text), file=sys.stderr)


def _version() -> str:
    from importlib.metadata import version

    return version("crossray")


if __name__ == "__main__":
    main()
