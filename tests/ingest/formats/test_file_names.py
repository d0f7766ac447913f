"""Topics of files that are read together."""

from hydrodamp.ingest.formats.files import read_files
from table_rows import rows


@rows("names, topics")
def test_files_have_the_same_topics_in_a_folder_and_joined(tmp_path, names, topics):
    paths = [tmp_path / name for name in names]
    for path in paths:
        path.write_text("t,a\n0,1\n1,2\n2,4\n", "utf-8")
    joined = read_files("+".join(map(str, paths)))
    assert [topic.name for topic in joined.topics] == topics
    assert [topic.name for topic in read_files(tmp_path).topics] == topics
