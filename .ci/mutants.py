"""Mutation testing of a crate with every mutant in one program, each behind a switch: see `.ci/mutants`."""
import collections, concurrent.futures, hashlib, json, os, pathlib, resource, shutil, subprocess, sys, threading, time

ROOT = pathlib.Path(__file__).resolve().parent.parent
HERE = ROOT / "mutants"
TARGET = pathlib.Path(os.environ.get("MUTANTS_TARGET", ROOT / "target" / "mutants"))
# A test is not begun with which a mutant would take more seconds than this; one that takes five times as long as it should, and at least
# LEAST_S, counts as failed: more where other programs run beside it.
BUDGET_S = float(os.environ.get("MUTANTS_BUDGET_S", 30.0))
PATIENCE, LEAST_S = 5.0, float(os.environ.get("MUTANTS_LEAST_S", 5.0))
STOPPED = 1000
MEMORY = 8 << 30
SWITCHES = """//! Which of the mutants is on.
#![allow(missing_docs, clippy::unwrap_used)]
use std::{fs::{File, OpenOptions}, io::Write, sync::{Mutex, atomic::{AtomicBool, AtomicU32, Ordering::Relaxed}}};
const UNREAD: u32 = u32::MAX;
const WATCH: u32 = u32::MAX - 1;
static ACTIVE: AtomicU32 = AtomicU32::new(UNREAD);
static SEEN: [AtomicBool; LENGTH] = [const { AtomicBool::new(false) }; LENGTH];
static FILE: Mutex<Option<File>> = Mutex::new(None);
#[inline(always)]
pub fn on(id: u32) -> bool {
    let active = ACTIVE.load(Relaxed);
    active == id || (active >= WATCH && rare(active, id))
}
#[cold]
#[inline(never)]
fn rare(mut active: u32, id: u32) -> bool {
    if active == UNREAD {
        let asked = std::env::var("NDOF_SWITCH").unwrap_or_default();
        active = if asked == "watch" { WATCH } else { asked.parse().unwrap_or(0) };
        ACTIVE.store(active, Relaxed);
    }
    if active == WATCH && !SEEN[id as usize].load(Relaxed) && !SEEN[id as usize].swap(true, Relaxed) {
        let mut file = FILE.lock().unwrap_or_else(|e| e.into_inner());
        let file = file.get_or_insert_with(|| OpenOptions::new().append(true).create(true).open(std::env::var("NDOF_SEEN").unwrap()).unwrap());
        file.write_all(format!("{id}\\n").as_bytes()).unwrap();
    }
    active == id
}
"""


def cargo(tree, *arguments):
    environment = dict(os.environ, CARGO_TARGET_DIR=str(TARGET), RUSTFLAGS="--cap-lints=allow")
    return subprocess.run(["cargo", *arguments], cwd=tree, env=environment, capture_output=True, text=True)


def list_mutants(crate):
    out = subprocess.run(["cargo", "mutants", "--list", "--json", "--package", f"ndof-{crate}"], cwd=ROOT, capture_output=True, text=True, check=True)
    mutants = [m for m in json.loads(out.stdout)]
    for i, m in enumerate(mutants):
        m["id"] = i + 1
        del m["diff"]
    return mutants


def plant(crate, mutants, tree):
    """A copy of the sources with the switches in it; where they stand, and which have no place."""
    shutil.rmtree(tree / "crates" / crate / "src", ignore_errors=True)
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    for name in filter(None, files):
        to = tree / name
        source = ROOT / name
        if to.exists() and to.stat().st_mtime == source.stat().st_mtime and to.stat().st_size == source.stat().st_size:
            continue
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(source, to)
    out = subprocess.run([str(ROOT / ".ci/switches/target/release/switches"), str(tree)], input=json.dumps(mutants), capture_output=True, text=True)
    if out.returncode:
        sys.exit(out.stderr)
    src = tree / "crates" / crate / "src"
    lib = src / "lib.rs"
    lib.write_text(lib.read_text() + "\n#[doc(hidden)]\npub mod switches;\n")
    longest = max((m["id"] for m in mutants), default=0) + 1
    (src / "switches.rs").write_text(SWITCHES.replace("LENGTH", str(longest)))
    return json.loads(out.stdout)


def build(crate, mutants, tree):
    """Plants what compiles. Returns the mutants that do, and those that do not."""
    left, out_of_it, kinds = list(mutants), {}, {m["id"]: m["genre"] for m in mutants}
    for round in range(60):
        planted = plant(crate, left, tree)
        by_file = collections.defaultdict(list)
        for r in planted["ranges"]:
            by_file[r["file"]].append(r)
        drop = {i: "no place" for i in planted["unplaced"]}
        done = cargo(tree, "check", "--package", f"ndof-{crate}", "--lib", "--profile", "mutants", "--message-format=json")
        errors = 0
        for line in done.stdout.splitlines():
            message = json.loads(line)
            if message.get("reason") != "compiler-message" or message["message"]["level"] != "error" or not message["message"]["spans"]:
                continue
            errors += 1
            spans = message["message"]["spans"]
            for span in [s for s in spans if s["is_primary"]] or spans:
                # The smallest switch around the error, or what the error spans.
                a, b = span["byte_start"], span["byte_end"]
                here = by_file[span["file_name"]]
                around = [r for r in here if r["start"] <= a and b <= r["end"]]
                found = [min(around, key=lambda r: r["end"] - r["start"])] if around else [r for r in here if a <= r["start"] and r["end"] <= b]
                if not found:
                    lines = (tree / span["file_name"]).read_bytes()
                    start, end = lines.rfind(b"\n", 0, a), lines.find(b"\n", b)
                    found = [r for r in here if r["end"] > start and r["start"] < end]
                if (message["message"]["code"] or {}).get("code") == "E0004":
                    # An arm that may be off no longer covers what it did.
                    found = [min((r for r in here if r["start"] >= b and kinds[r["ids"][0]] in ("MatchArm", "MatchArmGuard")), key=lambda r: r["start"])]
                if not found:
                    # What a function gives back does not agree with what a switch at its start does.
                    found = [max((r for r in here if r["end"] <= a), key=lambda r: (r["end"], r["end"] - r["start"]), default=None)]
                    if found == [None]:
                        sys.exit(message["message"]["rendered"])
                for r in found:
                    for i in r["ids"]:
                        drop[i] = message["message"]["message"]
        if done.returncode == 0 and not drop:
            return left, out_of_it
        if done.returncode != 0 and not drop:
            sys.exit(done.stderr[-4000:])
        out_of_it |= drop
        left = [m for m in left if m["id"] not in out_of_it]
        print(f"  round {round}: {errors} errors, {len(out_of_it)} do not compile", flush=True)
    sys.exit("does not compile in the end")


def tests(crate, tree):
    done = cargo(tree, "test", "--no-run", "--package", f"ndof-{crate}", "--lib", "--tests", "--profile", "mutants", "--message-format=json")
    if done.returncode:
        sys.exit(done.stderr[-4000:])
    found = []
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("reason") == "compiler-artifact" and message.get("executable") and message["profile"]["test"]:
            exe = message["executable"]
            listed = subprocess.run([exe, "--list", "--format", "terse"], capture_output=True, text=True, cwd=tree / "crates" / crate).stdout
            found += [(exe, name.removesuffix(": test")) for name in listed.splitlines() if name.endswith(": test")]
    return found


def run_test(crate, tree, test, limit_s, **environment):
    """What a test ends with, `STOPPED` if it had to be, and the seconds it took."""
    start = time.monotonic()
    process = subprocess.Popen(
        [test[0], "--exact", test[1], "--test-threads=1"],
        cwd=tree / "crates" / crate,
        env=dict(os.environ, CARGO_MANIFEST_DIR=str(tree / "crates" / crate), RAYON_NUM_THREADS="2", **environment),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
    )
    try:
        code = process.wait(limit_s)
    except subprocess.TimeoutExpired:
        code = STOPPED
        os.killpg(process.pid, 9)
        process.wait()
    return code, time.monotonic() - start


def watch(crate, tree, found):
    """What each test runs, and how long it takes; a test that fails with all mutants off is an error."""
    seen = HERE / crate / "seen"
    shutil.rmtree(seen, ignore_errors=True)
    seen.mkdir(parents=True)

    def one(k):
        code, seconds = run_test(crate, tree, found[k], 10 * BUDGET_S, NDOF_SWITCH="watch", NDOF_SEEN=str(seen / str(k)))
        if code == STOPPED:
            print(f"  takes too long and is not asked: {found[k][1]}", flush=True)
            return set(), seconds
        code_off, seconds = run_test(crate, tree, found[k], 10 * BUDGET_S, NDOF_SWITCH="0")
        if code or code_off:
            print(f"  fails with every mutant off: {found[k][1]}", flush=True)
            return set(), seconds
        return ({int(line) for line in (seen / str(k)).read_text().split()} if (seen / str(k)).exists() else set()), seconds

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(one, range(len(found))))


def read(results):
    return [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []


def judge(crate, tree, mutants, found, watched, results):
    """Each mutant against the tests that run it: first those that caught its neighbours, then the short ones."""
    covering = collections.defaultdict(list)
    for k, (ids, _) in enumerate(watched):
        for i in ids:
            covering[i].append(k)
    kills, lock = collections.Counter(), threading.Lock()
    done = {r["name"] for r in read(results)}
    # In an order of chance, so that a run which is stopped is a fair sample.
    todo = sorted((m for m in mutants if m["name"] not in done), key=lambda m: hashlib.sha256(m["name"].encode()).digest())
    started, count = time.monotonic(), 0

    def one(m):
        nonlocal count
        function = (m["file"], (m.get("function") or {}).get("function_name"))
        with lock:
            worth = lambda k: (1 + 40 * kills[function, k] + 4 * kills[m["file"], k]) / (0.02 + watched[k][1])
            order = sorted(covering[m["id"]], key=worth, reverse=True)
        spent, by, left_out = 0.0, None, 0
        verdict = "missed" if order else "not run"
        for k in order:
            if spent + watched[k][1] > BUDGET_S:
                left_out += 1
                verdict = f"missed by {len(order) - left_out} of {len(order)}"
                continue
            code, seconds = run_test(crate, tree, found[k], max(LEAST_S, PATIENCE * watched[k][1]), NDOF_SWITCH=str(m["id"]))
            spent += seconds
            if code:
                verdict, by = "caught, never ended" if code == STOPPED else "caught", found[k][1]
                break
        with lock:
            if by:
                kills[function, k] += 1
                kills[m["file"], k] += 1
            count += 1
            with results.open("a") as out:
                out.write(json.dumps({"name": m["name"], "verdict": verdict, "by": by, "seconds": round(spent, 2)}) + "\n")
            if count % 100 == 0:
                print(f"  {count} of {len(todo)} after {time.monotonic() - started:.0f} s", flush=True)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(one, todo))


def reasons(crate):
    """Why those that are left are left: what `.ci/survivors` says, by name."""
    file, found, reason = ROOT / ".ci/survivors" / f"{crate}.txt", {}, None
    for line in file.read_text().splitlines() if file.exists() else []:
        if line.startswith("#"):
            reason = line.lstrip("# ")
        elif line.strip():
            found[line.strip()] = reason
    return found


def report(crate, results, outside):
    """The share that is caught, and who was not."""
    verdicts, known = read(results), reasons(crate)
    caught = sum(r["verdict"].startswith("caught") for r in verdicts)
    never = sum(r["verdict"] == "caught, never ended" for r in verdicts)
    left = sorted((r for r in verdicts if not r["verdict"].startswith("caught")), key=lambda r: r["name"])
    share = 100 * caught / max(len(verdicts), 1)
    print(f"{crate}: {caught} of {len(verdicts)} caught ({share:.1f} %), {never} of them because a test did not end; {outside} do not compile")
    print(f"  of {len(left)} that are left {sum(r['name'] in known for r in left)} have their reason in .ci/survivors/{crate}.txt; without:")
    for r in left:
        if r["name"] not in known:
            print(f"    {r['verdict']}: {r['name']}")
    sys.stdout.flush()


def main():
    arguments = [a for a in sys.argv[1:] if a != "--again"]
    again = "--again" in sys.argv
    shard, of = map(int, arguments[0].split("/"))
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT / ".ci/switches", check=True)
    for crate in arguments[1:]:
        home, tree = HERE / crate, HERE / f"tree-{crate}"
        home.mkdir(parents=True, exist_ok=True)
        mutants = [m for m in list_mutants(crate) if m["id"] % of == shard]
        sources = hashlib.sha256(b"".join(f.read_bytes() for f in sorted((ROOT / "crates" / crate).rglob("*.rs")))).hexdigest()[:12]
        results = home / f"{shard}-of-{of}-{sources}.jsonl"
        if again:
            # Those that the newest run missed, with the tests of now.
            newest = max((f for f in home.glob(f"{shard}-of-{of}-*.jsonl")), key=lambda f: f.stat().st_mtime)
            missed = {r["name"] for r in read(newest) if not r["verdict"].startswith("caught")}
            mutants = [m for m in mutants if m["name"] in missed]
            results = home / "again.jsonl"
            results.unlink(missing_ok=True)
        print(f"{crate}: {len(mutants)} mutants", flush=True)
        start = time.monotonic()
        inside, outside = build(crate, mutants, tree)
        found = tests(crate, tree)
        print(f"  {len(inside)} compile together, {len(found)} tests, {time.monotonic() - start:.0f} s", flush=True)
        names = {m["id"]: m["name"] for m in mutants}
        (home / ("again.json" if again else "outside.json")).write_text(json.dumps({names[i]: why for i, why in outside.items()}, indent=1))
        start = time.monotonic()
        watched = watch(crate, tree, found)
        print(f"  what the tests run: {time.monotonic() - start:.0f} s; {len(set().union(*(ids for ids, _ in watched)))} mutants are run at all", flush=True)
        for (exe, name), (_, seconds) in sorted(zip(found, watched), key=lambda t: -t[1][1])[:8]:
            print(f"    {seconds:6.2f} s {pathlib.Path(exe).name.rsplit('-', 1)[0]} {name}", flush=True)
        judge(crate, tree, inside, found, watched, results)
        report(crate, results, len(outside))


if __name__ == "__main__":
    main()
