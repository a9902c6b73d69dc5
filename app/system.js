// The system that the program sees, as WASI preview 1 asks for it: arguments, standard output and a folder in memory. There is no network in it,
// no clock of the wall, and no file but those that were handed in.
// A function, because the worker is made of its text: a page that was opened from a folder may load no script into a worker.
globalThis.ndofSystem = () => {
  const DONE = 0, BAD_FILE = 8, EXISTS = 20, INVALID = 28, IS_FOLDER = 31, MISSING = 44, UNSUPPORTED = 52;
  const STREAM = 2, FOLDER = 3, FILE = 4; // kinds of file
  const ROOT = 3; // the descriptor of the folder, after standard input, output and error
  const CREATE = 1, EXCLUSIVE = 4, TRUNCATE = 8; // flags of path_open
  const APPEND = 1;
  const BROKEN_OFF = 3; // the program's own code for a failure of the machine
  const WINDOW = 1 << 20; // bytes of a dropped file that are read at once

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

  // Paths come relative to the folder; `.` and empty parts say nothing.
  const tidy = path => path.split('/').filter(part => part && part !== '.').join('/');

  // Runs `ndof WORDS…` once. `files` are bytes or blobs by name; `heard` gets each line of standard error as it comes.
  // Returns the exit code, what was printed, and every file that was written.
  globalThis.ndofRun = async (module, words, files, heard = () => {}) => {
    const folder = new Map(Object.entries(files).map(([name, held]) => [name, held instanceof Uint8Array ? new Written(held) : new Dropped(held)]));
    const given = new Set(folder.values()), folders = new Set(['']), printed = [new Written(), new Written(), new Written()];
    const open = new Map([0, 1, 2].map(number => [number, { stream: printed[number] }]));
    open.set(ROOT, { path: '' });
    let memory, line = '';
    const decoder = new TextDecoder(), bytes = () => new Uint8Array(memory.buffer), view = () => new DataView(memory.buffer);
    const text = (place, length) => tidy(decoder.decode(bytes().slice(place, place + length)));
    const pieces = (list, count) => Array.from({ length: count }, (_, k) => [view().getUint32(list + 8 * k, true), view().getUint32(list + 8 * k + 4, true)]);
    const put32 = (place, value) => { view().setUint32(place, value, true); return DONE; };
    const put64 = (place, value) => { view().setBigUint64(place, BigInt(value), true); return DONE; };
    const strings = words.map(word => new TextEncoder().encode(`${word}\0`));

    const listen = piece => {
      const parts = (line + decoder.decode(piece)).split('\n');
      line = parts.pop();
      parts.forEach(heard);
    };
    const status = (place, kind, size) => {
      bytes().fill(0, place, place + 64);
      view().setUint8(place + 16, kind);
      return put64(place + 32, size);
    };
    const found = path => (folder.has(path) ? [FILE, folder.get(path).size] : folders.has(path) ? [FOLDER, 0] : null);
    const withFile = (number, act) => { const entry = open.get(number); return entry?.file ? act(entry) : entry ? IS_FOLDER : BAD_FILE; };
    const read = (file, at, list, count) => {
      let total = 0;
      for (const [place, length] of pieces(list, count)) {
        for (let done = 0; done < length;) {
          const part = file.read(at + total, length - done);
          if (!part.length) return total;
          bytes().set(part, place + done);
          done += part.length;
          total += part.length;
        }
      }
      return total;
    };

    const system = {
      args_sizes_get: (count, size) => put32(count, strings.length) || put32(size, strings.reduce((sum, word) => sum + word.length, 0)),
      args_get(list, place) {
        strings.forEach((word, k) => { put32(list + 4 * k, place); bytes().set(word, place); place += word.length; });
        return DONE;
      },
      environ_sizes_get: (count, size) => put32(count, 0) || put32(size, 0),
      environ_get: () => DONE,
      clock_res_get: (id, place) => put64(place, 1000),
      clock_time_get: (id, precision, place) => put64(place, Math.round(performance.now() * 1e6)),
      random_get(place, length) {
        for (let from = place; from < place + length; from += 65536) crypto.getRandomValues(bytes().subarray(from, Math.min(from + 65536, place + length)));
        return DONE;
      },
      sched_yield: () => DONE,
      proc_exit(code) { throw new Exit(code); },
      fd_prestat_get: (number, place) => (number === ROOT ? put32(place, 0) || put32(place + 4, 1) : BAD_FILE),
      fd_prestat_dir_name(number, place) { bytes()[place] = '/'.charCodeAt(0); return DONE; },
      fd_fdstat_get(number, place) {
        const entry = open.get(number);
        if (!entry) return BAD_FILE;
        bytes().fill(0, place, place + 24);
        view().setUint8(place, entry.stream ? STREAM : entry.file ? FILE : FOLDER);
        view().setUint16(place + 2, entry.append ? APPEND : 0, true);
        put64(place + 8, 0xffff_ffffn);
        return put64(place + 16, 0xffff_ffffn);
      },
      fd_fdstat_set_flags: () => DONE,
      fd_filestat_get(number, place) {
        const entry = open.get(number);
        return entry ? status(place, ...(entry.file ? [FILE, entry.file.size] : entry.stream ? [STREAM, 0] : [FOLDER, 0])) : BAD_FILE;
      },
      fd_filestat_set_size: (number, size) => withFile(number, ({ file }) => (file instanceof Written ? (file.resize(Number(size)), DONE) : UNSUPPORTED)),
      fd_read(number, list, count, place) {
        if (number === 0) return put32(place, 0); // nobody types
        return withFile(number, entry => {
          const total = read(entry.file, entry.at, list, count);
          entry.at += total;
          return put32(place, total);
        });
      },
      fd_pread: (number, list, count, at, place) => withFile(number, ({ file }) => put32(place, read(file, Number(at), list, count))),
      fd_write(number, list, count, place) {
        const entry = open.get(number);
        if (!entry?.file && !entry?.stream) return BAD_FILE;
        const file = entry.file ?? entry.stream;
        if (!(file instanceof Written)) return UNSUPPORTED;
        let total = 0;
        for (const [from, length] of pieces(list, count)) {
          const piece = bytes().slice(from, from + length), at = entry.stream || entry.append ? file.size : entry.at;
          file.write(at, piece);
          entry.at = at + length;
          total += length;
          if (number === 2) listen(piece);
        }
        return put32(place, total);
      },
      fd_seek(number, offset, whence, place) {
        return withFile(number, entry => {
          const at = [0, entry.at, entry.file.size][whence] + Number(offset);
          if (at < 0) return INVALID;
          entry.at = at;
          return put64(place, at);
        });
      },
      fd_tell: (number, place) => withFile(number, entry => put64(place, entry.at)),
      fd_close: number => (open.delete(number) ? DONE : BAD_FILE),
      fd_sync: () => DONE,
      fd_datasync: () => DONE,
      path_open(start, follow, place, length, flags, rights, inherited, state, result) {
        const path = text(place, length), there = found(path);
        if (!there && !(flags & CREATE)) return MISSING;
        if (there && flags & CREATE && flags & EXCLUSIVE) return EXISTS;
        if (!there) folder.set(path, new Written());
        const file = folder.get(path);
        if (file && flags & TRUNCATE) {
          if (!(file instanceof Written)) return UNSUPPORTED;
          file.resize(0);
        }
        const number = Math.max(...open.keys()) + 1;
        open.set(number, file ? { file, at: 0, append: Boolean(state & APPEND) } : { path });
        return put32(result, number);
      },
      path_filestat_get(start, follow, place, length, result) {
        const there = found(text(place, length));
        return there ? status(result, ...there) : MISSING;
      },
      path_create_directory(start, place, length) {
        const path = text(place, length);
        if (found(path)) return EXISTS;
        folders.add(path);
        return DONE;
      },
      path_rename(start, place, length, end, target, size) {
        const from = text(place, length), file = folder.get(from);
        if (!file) return MISSING;
        folder.delete(from);
        folder.set(text(target, size), file);
        return DONE;
      },
      path_unlink_file: (start, place, length) => (folder.delete(text(place, length)) ? DONE : MISSING),
    };
    const imports = {};
    for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = system[name] ?? (() => UNSUPPORTED);
    const { exports } = await WebAssembly.instantiate(module, imports);
    memory = exports.memory;
    let code = 0;
    try {
      exports._start();
    } catch (error) {
      // What else breaks a program off is a trap, or a file that was taken away: its message is what there is to say.
      code = error instanceof Exit ? error.code : BROKEN_OFF;
      if (!(error instanceof Exit)) printed[2].write(printed[2].size, new TextEncoder().encode(`error: ${error.message}\n`));
    }
    const whole = file => decoder.decode(file.read(0, file.size));
    const written = [...folder].filter(([, file]) => file instanceof Written && !given.has(file)).map(([name, file]) => [name, file.read(0, file.size).slice()]);
    return { code, output: whole(printed[1]), errors: whole(printed[2]), files: Object.fromEntries(written) };
  };
};
