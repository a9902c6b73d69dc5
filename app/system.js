// The system that the program sees, as WASI preview 1 asks for it: arguments, standard output and a folder in memory. There is no network in it,
// no clock of the wall, and no file but those that were handed in.
// A function, because the worker is made of its text: a page that was opened from a folder may load no script into a worker.
globalThis.ndofSystem = () => {
  const DONE = 0, BAD_FILE = 8, EXISTS = 20, INVALID = 28, IS_FOLDER = 31, MISSING = 44, UNSUPPORTED = 52;
  const STREAM = 2, FOLDER = 3, FILE = 4; // kinds of file
  const ROOT = 3; // the descriptor of the folder, after standard input, output and error
  const CREATE = 1, EXCLUSIVE = 4, TRUNCATE = 8; // flags of path_open
  const APPEND = 1; // a flag of descriptors
  const BROKEN_OFF = 3; // the program's own exit code for a failure of the machine
  const WINDOW = 1 << 20; // bytes of a dropped file that are read at once
  const RANDOM_AT_ONCE = 65536; // the most that browsers give

  // How the program ends.
  class Exit { constructor(code) { this.code = code; } }

  // A file that was dropped: read as it is needed, so that a long recording does not fill the memory.
  class Dropped {
    constructor(blob) { this.blob = blob; this.from = 0; this.window = new Uint8Array(0); }
    get size() { return this.blob.size; }
    read(at, length) {
      if (at < this.from || at >= this.from + this.window.length) {
        this.from = at;
        this.window = new Uint8Array(new FileReaderSync().readAsArrayBuffer(this.blob.slice(at, at + WINDOW)));
      }
      return this.window.subarray(at - this.from, at - this.from + length);
    }
  }

  // A file in memory, which grows.
  class Written {
    constructor(bytes = new Uint8Array(0)) { this.space = bytes; this.size = bytes.length; }
    read(at, length) { return this.space.subarray(at, Math.min(at + length, this.size)); }
    resize(size) {
      if (size > this.space.length) {
        const space = new Uint8Array(Math.max(size, 2 * this.space.length));
        space.set(this.space.subarray(0, this.size));
        this.space = space;
      } else this.space.fill(0, size, this.size);
      this.size = size;
    }
    write(at, bytes) {
      if (at + bytes.length > this.size) this.resize(at + bytes.length);
      this.space.set(bytes, at);
    }
  }

  const decoder = new TextDecoder();
  // Paths come relative to the folder; `.` and empty parts say nothing.
  const tidy = path => path.split('/').filter(part => part && part !== '.').join('/');

  // One run of the program: its memory, its folder and what it has open.
  class Run {
    constructor(words, files, heard) {
      this.words = words.map(word => new TextEncoder().encode(`${word}\0`));
      this.folder = new Map(Object.entries(files).map(([name, held]) => [name, held instanceof Uint8Array ? new Written(held) : new Dropped(held)]));
      this.given = new Set(this.folder.values());
      this.folders = new Set(['']);
      this.printed = [new Written(), new Written(), new Written()];
      this.open = new Map([0, 1, 2].map(number => [number, { stream: this.printed[number], at: 0 }]));
      this.open.set(ROOT, { path: '' });
      this.heard = heard;
      this.line = '';
    }
    get bytes() { return new Uint8Array(this.memory.buffer); }
    get view() { return new DataView(this.memory.buffer); }
    put32(place, value) { this.view.setUint32(place, value, true); return DONE; }
    put64(place, value) { this.view.setBigUint64(place, BigInt(value), true); return DONE; }
    path(place, length) { return tidy(decoder.decode(this.bytes.slice(place, place + length))); }
    pieces(list, count) { return Array.from({ length: count }, (_, k) => [this.view.getUint32(list + 8 * k, true), this.view.getUint32(list + 8 * k + 4, true)]); }
    status(place, kind, size) {
      this.bytes.fill(0, place, place + 64);
      this.view.setUint8(place + 16, kind);
      return this.put64(place + 32, size);
    }
    found(path) { return this.folder.has(path) ? [FILE, this.folder.get(path).size] : this.folders.has(path) ? [FOLDER, 0] : null; }
    withFile(number, act) { const entry = this.open.get(number); return entry?.file ? act(entry) : entry ? IS_FOLDER : BAD_FILE; }
    read(file, at, list, count) {
      let total = 0;
      for (const [place, length] of this.pieces(list, count)) {
        for (let done = 0; done < length;) {
          const part = file.read(at + total, length - done);
          if (!part.length) return total;
          this.bytes.set(part, place + done);
          done += part.length;
          total += part.length;
        }
      }
      return total;
    }
    listen(piece) {
      const parts = (this.line + decoder.decode(piece)).split('\n');
      this.line = parts.pop();
      parts.forEach(this.heard);
    }
  }

  // What the program asks of its surroundings.
  const surroundings = run => ({
    args_sizes_get: (count, size) => run.put32(count, run.words.length) || run.put32(size, run.words.reduce((sum, word) => sum + word.length, 0)),
    args_get(list, place) {
      run.words.forEach((word, k) => { run.put32(list + 4 * k, place); run.bytes.set(word, place); place += word.length; });
      return DONE;
    },
    environ_sizes_get: (count, size) => run.put32(count, 0) || run.put32(size, 0),
    environ_get: () => DONE,
    clock_res_get: (id, place) => run.put64(place, 1000),
    clock_time_get: (id, precision, place) => run.put64(place, Math.round(performance.now() * 1e6)),
    random_get(place, length) {
      for (let from = place; from < place + length; from += RANDOM_AT_ONCE) crypto.getRandomValues(run.bytes.subarray(from, Math.min(from + RANDOM_AT_ONCE, place + length)));
      return DONE;
    },
    sched_yield: () => DONE,
    proc_exit(code) { throw new Exit(code); },
  });

  // What it does with files that are open.
  const descriptors = run => ({
    fd_prestat_get: (number, place) => (number === ROOT ? run.put32(place, 0) || run.put32(place + 4, 1) : BAD_FILE),
    fd_prestat_dir_name(number, place) { run.bytes[place] = '/'.charCodeAt(0); return DONE; },
    fd_fdstat_get(number, place) {
      const entry = run.open.get(number);
      if (!entry) return BAD_FILE;
      run.bytes.fill(0, place, place + 24);
      run.view.setUint8(place, entry.stream ? STREAM : entry.file ? FILE : FOLDER);
      run.view.setUint16(place + 2, entry.append ? APPEND : 0, true);
      return run.put64(place + 8, 0xffff_ffffn) || run.put64(place + 16, 0xffff_ffffn); // every right
    },
    fd_fdstat_set_flags: () => DONE,
    fd_filestat_get(number, place) {
      const entry = run.open.get(number);
      return entry ? run.status(place, ...(entry.file ? [FILE, entry.file.size] : entry.stream ? [STREAM, 0] : [FOLDER, 0])) : BAD_FILE;
    },
    fd_filestat_set_size: (number, size) => run.withFile(number, ({ file }) => (file instanceof Written ? (file.resize(Number(size)), DONE) : UNSUPPORTED)),
    fd_read(number, list, count, place) {
      const entry = run.open.get(number), file = entry?.file ?? entry?.stream;
      if (!file) return entry ? IS_FOLDER : BAD_FILE;
      const total = run.read(file, entry.at, list, count);
      entry.at += total;
      return run.put32(place, total);
    },
    fd_pread: (number, list, count, at, place) => run.withFile(number, ({ file }) => run.put32(place, run.read(file, Number(at), list, count))),
    fd_write(number, list, count, place) {
      const entry = run.open.get(number), file = entry?.file ?? entry?.stream;
      if (!(file instanceof Written)) return file ? UNSUPPORTED : BAD_FILE;
      let total = 0;
      for (const [from, length] of run.pieces(list, count)) {
        const piece = run.bytes.slice(from, from + length), at = entry.stream || entry.append ? file.size : entry.at;
        file.write(at, piece);
        entry.at = at + length;
        total += length;
        if (number === 2) run.listen(piece);
      }
      return run.put32(place, total);
    },
    fd_seek: (number, offset, whence, place) => run.withFile(number, entry => {
      const at = [0, entry.at, entry.file.size][whence] + Number(offset);
      if (at < 0) return INVALID;
      entry.at = at;
      return run.put64(place, at);
    }),
    fd_tell: (number, place) => run.withFile(number, entry => run.put64(place, entry.at)),
    fd_close: number => (run.open.delete(number) ? DONE : BAD_FILE),
    fd_sync: () => DONE,
    fd_datasync: () => DONE,
  });

  // What it does with names.
  const paths = run => ({
    path_open(start, follow, place, length, flags, rights, inherited, state, result) {
      const path = run.path(place, length), there = run.found(path);
      if (!there && !(flags & CREATE)) return MISSING;
      if (there && flags & CREATE && flags & EXCLUSIVE) return EXISTS;
      if (!there) run.folder.set(path, new Written());
      const file = run.folder.get(path);
      if (file && flags & TRUNCATE) {
        if (!(file instanceof Written)) return UNSUPPORTED;
        file.resize(0);
      }
      const number = Math.max(...run.open.keys()) + 1;
      run.open.set(number, file ? { file, at: 0, append: Boolean(state & APPEND) } : { path });
      return run.put32(result, number);
    },
    path_filestat_get(start, follow, place, length, result) {
      const there = run.found(run.path(place, length));
      return there ? run.status(result, ...there) : MISSING;
    },
    path_create_directory(start, place, length) {
      const path = run.path(place, length);
      if (run.found(path)) return EXISTS;
      run.folders.add(path);
      return DONE;
    },
    path_rename(start, place, length, end, target, size) {
      const from = run.path(place, length), file = run.folder.get(from);
      if (!file) return MISSING;
      run.folder.delete(from);
      run.folder.set(run.path(target, size), file);
      return DONE;
    },
    path_unlink_file: (start, place, length) => (run.folder.delete(run.path(place, length)) ? DONE : MISSING),
  });

  // Runs `WORDS…` once. `files` are bytes or blobs by name; `heard` gets each line of standard error as it comes.
  // Returns the exit code, what was printed, and every file that was written.
  globalThis.ndofRun = async (module, words, files, heard = () => {}) => {
    const run = new Run(words, files, heard), system = { ...surroundings(run), ...descriptors(run), ...paths(run) }, imports = {};
    for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = system[name] ?? (() => UNSUPPORTED);
    const { exports } = await WebAssembly.instantiate(module, imports);
    run.memory = exports.memory;
    const [, output, errors] = run.printed;
    let code = 0;
    try {
      exports._start();
    } catch (error) {
      // What else breaks a program off is a trap, or a file that was taken away: its message is what there is to say.
      code = error instanceof Exit ? error.code : BROKEN_OFF;
      if (!(error instanceof Exit)) errors.write(errors.size, new TextEncoder().encode(`error: ${error.message}\n`));
    }
    const whole = file => decoder.decode(file.read(0, file.size));
    const written = [...run.folder].filter(([, file]) => file instanceof Written && !run.given.has(file)).map(([name, file]) => [name, file.read(0, file.size).slice()]);
    return { code, output: whole(output), errors: whole(errors), files: Object.fromEntries(written) };
  };
};
